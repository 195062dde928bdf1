// Public header of the library: all that an external harness needs to run a detector on frames. See README for a
// complete program.
#pragma once

#include "contact/contact_set.hpp"
#include "geometry/input_error.hpp"
#include "method/detector.hpp"
#include "method/registry.hpp"
#include "scene/recording.hpp"
#include "scene/world.hpp"
