// Triangle pairs of every class and case of thesis §3.4, to measure the response time per pair. Balls or the edges of a
// fold are pressed into a surface; contacts come from `derive`.
#pragma once

#include <string>
#include <vector>

#include "contact/contact_set.hpp"
#include "scene/world.hpp"

namespace trocar::bench {

struct PairClass {
    std::string name;  ///< class and case, "I2T tissue vertex in face"
    Topology topology;
    Materials materials;
    Frame frame;
    ContactSet contacts;  ///< contacts of this class and case only
    static constexpr double dt = 1e-3;
};

/// I2I, I2R, I2T (three cases), R2T and T2T, some dozens of contacts each; crossing edges are separate entries.
std::vector<PairClass> pair_classes();

}  // namespace trocar::bench
