// Text files of triangle pairs, one per line, for the triangle test and for the families of hard pairs.
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <vector>

#include "geometry/crossing.hpp"
#include "geometry/exact.hpp"

namespace trocar {

inline constexpr std::array<PairClass, 6> all_pair_classes{PairClass::disjoint,    PairClass::touch_vertex,
                                                           PairClass::touch_edge,  PairClass::coplanar_overlap,
                                                           PairClass::transversal, PairClass::degenerate};

struct PairLine {
    std::size_t number = 0;  ///< of the line in the file, from 1
    Corners first;
    Corners second;
    std::optional<bool> truth;
    std::optional<PairClass> pair_class;
};

/// 18 numbers per line, then optionally truth (0 or 1) and the class; empty lines are skipped. Throws InputError with
/// the line number.
std::vector<PairLine> read_pair_file(const std::filesystem::path& path);

}  // namespace trocar
