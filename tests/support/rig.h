/* A small renderer for tests, words to furnish its scene with, and what its picture shows. */
#ifndef LUM_TESTS_SUPPORT_RIG_H
#define LUM_TESTS_SUPPORT_RIG_H

#include "tests/support/rig_picture.h"
#include "tests/support/rig_scene.h"

#endif
