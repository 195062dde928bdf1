// Single stages by Google Benchmark: the triangle tests, derive and every registered response per triangle pair, the
// thesis' response per class and case, and every registered detector with its defaults on one small scene.
#pragma once

#include <vector>

#include "cells.hpp"

namespace trocar::bench {

/// Names "triangle test exact, apart", "derive", "response thesis", "detector ohc". Empty without Google Benchmark,
/// with the reason in `missing`.
std::vector<MicroResult> run_micro(bool quick, std::vector<Missing>& missing);

}  // namespace trocar::bench
