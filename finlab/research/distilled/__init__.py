"""Policies for all robots, distilled from method `dual`: where Newton's method on its dual begins,
or forces, proposed by networks that have learned from exact answers of many robots.

`actuator_tokens.py` is what a network reads of a robot, `network.py` the networks,
`exact_answers.py` the data, `train.py` the training, `starts.py` and `force_policy.py` what is
compared, `differentiable.py` the answers with their derivatives. docs/theory/distilled.md says what
it gives.
"""
