// The library's front door: everything an outside harness needs to put frames before a detector.
// See README for a complete program.
#pragma once

#include "contact/contact_set.hpp"
#include "geometry/input_error.hpp"
#include "method/detector.hpp"
#include "method/registry.hpp"
#include "scene/recording.hpp"
#include "scene/world.hpp"
