#include "trocar/trocar.hpp"
