// What the contract tests share: the scenes that every detector is asked about, by property, and how one is asked.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "measure/permutation.hpp"
#include "method/registry.hpp"
#include "support/world_triangles.hpp"

namespace trocar::test {

using Pairs = std::vector<TrianglePair>;
using Settings = std::map<std::string, std::string>;

// ---- scenes ----

World sphere_in_sheet();
World shaft_in_slab();
World integer_lattice();
World many_bodies();
/// Different shapes in general position, metres, near the origin.
std::vector<World> general_scenes();
std::vector<World> long_triangle_scenes();
std::vector<World> touching_scenes();
std::vector<World> zero_area_scenes();

World moved(World world, const Vector3& by);
World scaled(World world, double factor);

// ---- questions ----

std::unique_ptr<Detector> make(const DetectorEntry& entry, const Settings& settings = {});
/// Pairs only, unless native contacts are asked for: libraries may find pairs that they can give no contact for.
ContactSet answer(Detector& detector, const World& world, bool native = false, double query_distance = 0.0);
ContactSet answer_of(const DetectorEntry& entry, const World& world, const Settings& settings = {}, bool native = false,
                     double query_distance = 0.0);
/// In the numbers of the world as it was.
ContactSet permuted_answer(const DetectorEntry& entry, const World& world, const Permutation& permutation,
                           double query_distance = 0.0);

// ---- checks: empty text = kept ----

std::string over(const std::vector<World>& worlds, const std::function<std::string(const World&)>& check);

/// Every registered detector but the controls, and our own once more with each option that changes the algorithm but
/// not the pairs.
const std::vector<DetectorEntry>& methods();

/// (method, check) -> reason, of the gaps that are known: of the list `detectors` or `response_contract`.
std::map<std::pair<std::string, std::string>, std::string> known_gaps(const std::string& list);

/// What to expect of a check: nothing failed, or, where the list has a gap of the check for one of these names of the
/// method, that something still does.
void expect_kept(const std::string& list, const std::vector<std::string>& names, const std::string& check,
                 const std::string& failures);

}  // namespace trocar::test
