#include "geometry/types.hpp"
