#include "protocol/record/date.h"

#include <string.h>

static bool is_leap(int year)
{
    return (year % 4 == 0 && year % 100 != 0) || year % 400 == 0;
}

static int number(const char *text, int digits)
{
    int n = 0;
    for (int i = 0; i < digits; i++)
        n = 10 * n + (text[i] - '0');
    return n;
}

bool lum_date_read(const char *text, int ymd[3])
{
    static const char form[] = "dddd-dd-dd";
    static const int days[12] = {31, 28, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31};
    if (strlen(text) != sizeof form - 1)
        return false;
    for (size_t i = 0; i < sizeof form - 1; i++)
        if (form[i] == 'd' ? text[i] < '0' || text[i] > '9' : text[i] != form[i])
            return false;
    ymd[0] = number(text, 4);
    ymd[1] = number(text + 5, 2);
    ymd[2] = number(text + 8, 2);
    if (ymd[0] < LUM_DATE_FIRST_YEAR || ymd[0] > LUM_DATE_LAST_YEAR || ymd[1] < 1 || ymd[1] > 12)
        return false;
    return ymd[2] >= 1 && ymd[2] <= days[ymd[1] - 1] + (ymd[1] == 2 && is_leap(ymd[0]));
}
