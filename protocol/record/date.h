/* Dates of the Gregorian calendar, as records have them: "2026-06-21". */
#ifndef LUM_PROTOCOL_RECORD_DATE_H
#define LUM_PROTOCOL_RECORD_DATE_H

#include <stdbool.h>

/* Years for which the sun's place is as exact as it is said to be (core/light/solar.h). */
#define LUM_DATE_FIRST_YEAR 1900
#define LUM_DATE_LAST_YEAR 2100

/* Year, month (1: January), day. False: it is none, or of another year. */
bool lum_date_read(const char *text, int ret_ymd[3]);

#endif
