// Single stages with Google Benchmark. Covered: triangle tests, `derive`, every response per triangle pair, the thesis'
// response per class and case, every detector on one small scene.
#pragma once

#include <vector>

#include "cells.hpp"

namespace trocar::bench {

/// Result names: "triangle test exact, apart", "derive", "response thesis", "detector ohc". Empty without Google
/// Benchmark, with the reason in `missing`.
std::vector<MicroResult> run_micro(bool quick, std::vector<Missing>& missing);

}  // namespace trocar::bench
