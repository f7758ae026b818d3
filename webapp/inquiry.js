// The dialog with questions about a file: one choice of several, any of several, or two numbers. The answers go to
// inquiry.py, which closes the dialog when they will do.
(() => {
  const signed = (text) => text.replace(/(^|[\s(])-(?=\d)/g, '$1\u2212');
  const make = (tag, className, text) => Object.assign(document.createElement(tag), { className, textContent: signed(text ?? '') });

  // Radio buttons or check boxes with their words, and below them what each would make of the file.
  function choicesOf(question, index) {
    const list = make('div', question.several ? 'choices several' : 'choices');
    const marked = question.marked;
    for (const [value, words, meaning] of question.choices) {
      const label = make('label', 'choice');
      const box = Object.assign(document.createElement('input'), {
        type: question.several ? 'checkbox' : 'radio', name: `fl-inquiry-${index}`, value, checked: marked.includes(value),
      });
      const text = make('span', '', words);
      if (meaning) text.append(make('small', '', meaning));
      label.append(box, text);
      list.append(label);
    }
    if (question.numbers) list.append(numbersOf(question, index));
    return list;
  }

  // A choice with two boxes for numbers; to type into one chooses it.
  function numbersOf(question, index) {
    const typed = question.marked.length === 2;
    const label = make('label', 'choice numbers');
    const radio = Object.assign(document.createElement('input'), {
      type: 'radio', name: `fl-inquiry-${index}`, value: '', checked: typed });
    label.append(radio, make('span', '', 'Another, the same for all'));
    ['astern', 'ahead'].forEach((way, place) => {
      const box = Object.assign(document.createElement('input'), { type: 'text', inputMode: 'decimal', value: typed ? question.marked[place] : '' });
      box.setAttribute('aria-label', `force ${way} [N]`);
      box.placeholder = `${way} [N]`;
      box.onfocus = () => { radio.checked = true; };
      label.append(box);
    });
    return label;
  }

  function answerOf(field) {
    const chosen = [...field.querySelectorAll('input:checked')];
    if (chosen.some((box) => box.value === '')) return [...field.querySelectorAll('input[type=text]')].map((box) => box.value);
    return chosen.map((box) => box.value);
  }

  function close() {
    document.querySelector('.fl-inquiry')?.remove();
  }

  function ask(title, text, questions) {
    close();
    document.querySelector('.fl-ask')?.remove();
    const veil = make('div', 'fl-inquiry');
    const card = make('form', 'card');
    card.setAttribute('role', 'dialog');
    card.setAttribute('aria-modal', 'true');
    card.setAttribute('aria-label', title);
    card.append(make('h2', '', title), make('p', '', text));
    const body = make('div', 'questions');
    body.tabIndex = -1;
    const fields = questions.map((question, index) => {
      const field = make('fieldset', '');
      field.append(make('legend', '', question.asks), make('p', '', question.why), choicesOf(question, index));
      body.append(field);
      return field;
    });
    const row = make('div', 'row');
    const open = Object.assign(make('button', 'primary', 'Open'), { type: 'submit' });
    const cancel = Object.assign(make('button', '', 'Cancel'), { type: 'button', onclick: close });
    row.append(open, cancel);
    card.append(body, row);
    card.onsubmit = (event) => {
      event.preventDefault();
      const answers = Object.fromEntries(questions.map((question, index) => [question.option, answerOf(fields[index])]));
      window.finlabPresses.tell('inquiry', '', JSON.stringify(answers));
    };
    card.onkeydown = (event) => {
      event.stopPropagation();
      if (event.key === 'Escape') close();
      if (event.key !== 'Tab') return;
      const stops = [...card.querySelectorAll('input, button')];
      const end = event.shiftKey ? stops[0] : stops[stops.length - 1];
      if (document.activeElement !== end) return;
      event.preventDefault();
      (event.shiftKey ? stops[stops.length - 1] : stops[0]).focus();
    };
    veil.append(card);
    document.body.append(veil);
    (card.querySelector('input:checked') ?? card.querySelector('input') ?? open).focus();
  }

  // Leads to a box of the page by its label.
  function point(label) {
    let tries = 0;
    const look = () => {
      const words = [...document.querySelectorAll('label, p, span')].find(
        (element) => element.offsetParent && element.textContent.trim() === label && !element.closest('.fl'));
      const row = words?.closest('.mantine-Flex-root') ?? words?.parentElement;
      if (!row) {
        if (++tries < 20) setTimeout(look, 100);
        return;
      }
      row.scrollIntoView({ block: 'center' });
      row.classList.add('fl-pointed');
      setTimeout(() => row.classList.remove('fl-pointed'), 2500);
      row.querySelector('input:not([type=hidden])')?.focus();
    };
    look();
  }

  window.finlabInquiry = { ask, close, point };
})();
