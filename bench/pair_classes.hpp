// Real triangle pairs of every class and case of thesis §3.4, so that the time of a response per pair is known for
// each: a block of balls or a fold's edges pressed into a surface, contacts by the shared stage `derive`.
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
    ContactSet contacts;  ///< of this class and case only
    static constexpr double dt = 1e-3;
};

/// I2I, I2R, I2T (three cases), R2T and T2T, some dozens of contacts each; those of crossing edges apart.
std::vector<PairClass> pair_classes();

}  // namespace trocar::bench
