/* The compiled core: what Python calls. SI units. */
#ifndef FINLAB_CORE_H
#define FINLAB_CORE_H

int fl_version(void);
double fl_answer(double x);

#endif
