#include "contract/contract_support.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <iostream>
#include <nlohmann/json.hpp>
#include <random>

#include "contract/shipped_folder.hpp"
#include "support/program.hpp"
#include "support/random_vectors.hpp"

namespace trocar::test {

std::filesystem::path& shipped_folder() {
    static std::filesystem::path folder(TROCAR_SOURCE_DIR);
    return folder;
}

namespace {
std::vector<std::filesystem::path>& added_gap_files() {
    static std::vector<std::filesystem::path> files;
    return files;
}
}  // namespace

std::vector<std::filesystem::path> gap_files() {
    std::vector<std::filesystem::path> files = added_gap_files();
    files.insert(files.begin(), shipped_folder() / "tests" / "known_gaps.json");
    return files;
}

void add_gap_file(const std::filesystem::path& file) { added_gap_files().push_back(file); }

World sphere_in_sheet() {
    return make_world("sphere through a sheet", {{BodyKind::instrument, sphere(0.03, 14).move({0.003, 0.001, 0.011})},
                                                 {BodyKind::tissue, sheet(0.1, 20).shake(0.0004, 1)}});
}
World shaft_in_slab() {
    return make_world(
        "fine shaft in a slab",
        {{BodyKind::instrument, shaft(0.004, 0.12, 12, 40).rotate({0.3, 1.0, 0.1}, 0.7).move({-0.03, 0.002, -0.013})},
         {BodyKind::tissue, slab(0.1, 0.01, 16).shake(0.0005, 2)}});
}

std::vector<World> general_scenes() {
    std::vector<World> worlds;
    worlds.push_back(sphere_in_sheet());
    worlds.push_back(shaft_in_slab());
    worlds.push_back(make_world(
        "two spheres", {{BodyKind::tissue, sphere(0.02, 16)},
                        {BodyKind::rigid, sphere(0.03, 12).rotate({1, 2, 3}, 0.4).move({0.031, 0.007, 0.009})}}));
    for (std::uint32_t seed : {11U, 12U, 13U, 14U}) {
        worlds.push_back(make_world(fmt::format("two soups, seed {}", seed),
                                    {{BodyKind::instrument, soup(150, 0.01, 0.05, seed)},
                                     {BodyKind::tissue, soup(220, 0.006, 0.05, seed + 100)}}));
    }
    worlds.push_back(
        make_world("two instruments of two parts, two tissues, a bone",
                   {{BodyKind::instrument, shaft(0.004, 0.1, 10, 20).move({0.01, 0.0, -0.02}), "left"},
                    {BodyKind::instrument, sphere(0.007, 10).move({0.011, 0.001, -0.021}), "left"},
                    {BodyKind::instrument,
                     shaft(0.003, 0.1, 9, 18).rotate({1.0, 0.2, 0.1}, 0.8).move({-0.01, 0.02, -0.03}), "right"},
                    {BodyKind::instrument, sphere(0.006, 9).move({0.012, 0.006, -0.019}), "right"},
                    {BodyKind::tissue, sheet(0.12, 18).shake(0.001, 5)},
                    {BodyKind::tissue, sphere(0.02, 14).rotate({1.0, 2.0, 0.5}, 0.3).move({0.0107, 0.0003, -0.0123})},
                    {BodyKind::rigid, slab(0.05, 0.01, 8).shake(0.0003, 6).move({0.02, 0.01, -0.017})}}));
    return worlds;
}

std::vector<World> long_triangle_scenes() {
    return {make_world("unsplit shaft across fine tissue",
                       {{BodyKind::instrument,
                         shaft(0.004, 0.3, 12, 1).rotate({0.2, 1.0, 0.05}, 1.5).move({-0.15, 0.001, 0.0017})},
                        {BodyKind::tissue, sheet(0.1, 40).shake(0.0003, 7)}}),
            make_world("one huge triangle in a soup",
                       {{BodyKind::rigid, triangle({-3.0, -2.0, 0.0011}, {2.5, -2.2, 0.0007}, {0.1, 3.0, -0.0013})},
                        {BodyKind::tissue, soup(400, 0.004, 0.05, 8)}}),
            make_world("two huge triangles and a soup",
                       {{BodyKind::rigid, triangle({-30.0, -2.0, 0.0011}, {25.0, -2.2, 0.0007}, {0.1, 3.0, -0.0013})},
                        {BodyKind::instrument, triangle({0.001, -20.0, -2.0}, {0.0, -22.0, 3.0}, {0.002, 30.0, -1.0})},
                        {BodyKind::tissue, soup(300, 0.004, 0.05, 9)}})};
}

World integer_lattice() {
    // Corners on a small grid: shared vertices, shared edges, coplanar overlaps and zero areas in plenty.
    std::mt19937 random(21);
    std::uniform_int_distribution<int> number(0, 3);
    std::vector<Part> parts(2);
    for (Part& part : parts) {
        for (int t = 0; t < 150; ++t) {
            std::array<Vector3, 3> c;
            do {
                for (Vector3& v : c) v = random_vector(number, random) * 0.0078125;
            } while ((c[1] - c[0]).cross(c[2] - c[0]).squaredNorm() == 0.0);
            part.shape.add(triangle(c[0], c[1], c[2]));
        }
    }
    return make_world("triangles on an integer lattice", parts);
}

std::vector<World> touching_scenes() {
    return {
        integer_lattice(),
        make_world("the same sheet twice", {{BodyKind::tissue, sheet(0.125, 8)}, {BodyKind::tissue, sheet(0.125, 8)}}),
        make_world("two slabs that share a face", {{BodyKind::tissue, slab(0.125, 0.0625, 4)},
                                                   {BodyKind::rigid, slab(0.125, 0.0625, 4).move({0.0, 0.0, 0.0625})}}),
        make_world("vertices exactly in the plane",
                   {{BodyKind::tissue, sheet(0.125, 4)},
                    {BodyKind::instrument, triangle({0.01, 0.02, 0.0}, {0.03, 0.0, 0.04}, {0.0, 0.01, 0.05})}})};
}

std::vector<World> zero_area_scenes() {
    const Vector3 inside(0.013, 0.007, 0.0);
    return {
        make_world("a segment through a sheet",
                   {{BodyKind::tissue, sheet(0.125, 4)},
                    {BodyKind::instrument, triangle({0.01, 0.005, 0.02}, {0.01, 0.005, -0.02}, {0.01, 0.005, 0.01})}}),
        make_world("a point on a sheet",
                   {{BodyKind::tissue, sheet(0.125, 4)}, {BodyKind::instrument, triangle(inside, inside, inside)}}),
        make_world("equal points", {{BodyKind::tissue, triangle(inside, inside, inside)},
                                    {BodyKind::instrument, triangle(inside, inside, inside)}}),
        make_world("all vertices of two bodies in one point", {{BodyKind::tissue, sheet(0.125, 4).scale(0.0)},
                                                               {BodyKind::instrument, sphere(0.1, 4).scale(0.0)}})};
}

World moved(World world, const Vector3& by) {
    world.frame = placed(world.frame, 1.0, by);
    return world;
}
World scaled(World world, double factor) {
    world.frame = placed(world.frame, factor, Vector3::Zero());
    return world;
}

World many_bodies() {
    std::vector<Part> parts;
    for (int k = 0; k < 70; ++k) {
        parts.push_back({k % 7 == 0 ? BodyKind::instrument : BodyKind::tissue,
                         sphere(0.011, 5)
                             .rotate({1.0, 0.3 * k, 0.2}, 0.1 * k)
                             .move({0.02 * (k % 9), 0.017 * (k / 9), 0.001 * (k % 5)})});
    }
    return make_world("seventy bodies", parts);
}

std::unique_ptr<Detector> make(const DetectorEntry& entry, const Settings& settings) {
    return entry.make(ParameterValues(entry.name, entry.parameters, settings));
}

ContactSet answer(Detector& detector, const World& world, bool native, double query_distance) {
    ContactSet contacts;
    contacts.native_wanted = native;
    detector.update(world.frame, query_distance);
    detector.detect(world.frame, contacts);
    return contacts;
}

ContactSet answer_of(const DetectorEntry& entry, const World& world, const Settings& settings, bool native,
                     double query_distance) {
    const auto detector = make(entry, settings);
    detector->prepare(world.topology, world.frame);
    return answer(*detector, world, native, query_distance);
}

ContactSet permuted_answer(const DetectorEntry& entry, const World& world, const Permutation& permutation,
                           double query_distance) {
    ContactSet contacts = answer_of(entry, {world.name, permutation.topology, permutation.permuted(world.frame)}, {},
                                    false, query_distance);
    contacts.pairs = permutation.original(contacts.pairs);
    contacts.near = permutation.original(contacts.near);
    return contacts;
}

std::string over(const std::vector<World>& worlds, const std::function<std::string(const World&)>& check) {
    std::string failures;
    for (const World& world : worlds) failures += check(world);
    return failures;
}

std::map<std::pair<std::string, std::string>, std::string> known_gaps(const std::string& list) {
    std::map<std::pair<std::string, std::string>, std::string> gaps;
    for (const std::filesystem::path& file : gap_files()) {
        const auto document = nlohmann::json::parse(read_file(file));
        for (const auto& gap : document.value(list, nlohmann::json::array())) {
            gaps[{gap.at("method").get<std::string>(), gap.at("check").get<std::string>()}] =
                gap.at("reason").get<std::string>();
        }
    }
    return gaps;
}

void expect_kept(const std::string& list, const std::vector<std::string>& names, const std::string& check,
                 const std::string& failures) {
    const auto gaps = known_gaps(list);
    for (const std::string& name : names) {
        const auto gap = gaps.find({name, check});
        if (gap == gaps.end()) continue;
        EXPECT_FALSE(failures.empty()) << "the known gap is closed, remove it: " << gap->second;
        std::cout << "known gap: " << gap->second << "\n" << failures;
        return;
    }
    EXPECT_TRUE(failures.empty()) << failures;
}

const std::vector<DetectorEntry>& methods() {
    static const std::vector<DetectorEntry> list = [] {
        std::vector<DetectorEntry> entries = registry().detectors();
        std::erase_if(entries, [](const DetectorEntry& entry) { return entry.control; });
        for (const DetectorEntry& entry : registry().detectors()) {
            for (std::size_t k = 0; entry.own && k < entry.parameters.size(); ++k) {
                if (entry.parameters[k].name != "swept") continue;
                DetectorEntry variant = entry;
                variant.name += "_swept";
                variant.parameters[k].default_value = "on";
                entries.push_back(std::move(variant));
            }
        }
        return entries;
    }();
    return list;
}

}  // namespace trocar::test
