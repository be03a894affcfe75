/* The table of methods: an estimator computes one or several effects of a frame, and a method is a row
 * that says which estimator serves each effect. Adding a method is one row, and its estimator one file. All methods
 * live in one binary and are chosen per view at run time. */
#ifndef LUM_CORE_METHOD_METHOD_H
#define LUM_CORE_METHOD_METHOD_H

#include "core/pass/method.h"
#include "core/trace/demand.h"

/* The table, in display order; n rows. */
const struct lum_method *lum_methods(size_t *ret_n);
const struct lum_method *lum_method_find(const char *name); /* NULL when there is none */
/* True when passes after the first whole picture make it better, so that a time or an error can end them. Of the others
 * one pass is the whole answer. */
bool lum_method_adds_samples(const struct lum_method *method);
/* True when lum_view_settings.n_vpls counts for the method: virtual point lights, or rays of a hemisphere. */
bool lum_method_counts_vpls(const struct lum_method *method);

#endif
