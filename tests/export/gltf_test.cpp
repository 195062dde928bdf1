#include "export/gltf.hpp"

#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>
#include <set>

#include "export/reported_run.hpp"
#include "support/program.hpp"

namespace trocar {
namespace {

using nlohmann::json;

/// A .glb taken apart, with nothing taken on trust.
struct Glb {
    json document;
    std::string binary;

    explicit Glb(const std::string& bytes) {
        EXPECT_EQ(bytes.substr(0, 4), "glTF");
        EXPECT_EQ(number(bytes, 4), 2U);
        EXPECT_EQ(number(bytes, 8), bytes.size());
        const std::size_t text = number(bytes, 12);
        EXPECT_EQ(text % 4, 0U);
        EXPECT_EQ(bytes.substr(16, 4), "JSON");
        document = json::parse(bytes.substr(20, text));
        const std::size_t size = number(bytes, 20 + text);
        EXPECT_EQ(size % 4, 0U);
        EXPECT_EQ(bytes.substr(24 + text, 4), std::string("BIN\0", 4));
        binary = bytes.substr(28 + text);
        EXPECT_EQ(binary.size(), size);
    }
    static std::uint32_t number(const std::string& bytes, std::size_t at) {
        std::uint32_t value = 0;
        std::memcpy(&value, bytes.data() + at, sizeof value);
        return value;
    }
    [[nodiscard]] static std::size_t width(const json& accessor) {
        return accessor["type"] == "SCALAR" ? 1 : accessor["type"] == "VEC3" ? 3 : 4;
    }
    [[nodiscard]] std::vector<float> floats(std::size_t index) const {
        const json& accessor = document["accessors"].at(index);
        EXPECT_EQ(accessor["componentType"], 5126);
        std::vector<float> values(accessor["count"].get<std::size_t>() * width(accessor));
        const json& view = document["bufferViews"].at(accessor["bufferView"].get<std::size_t>());
        std::memcpy(values.data(), binary.data() + view["byteOffset"].get<std::size_t>(),
                    values.size() * sizeof(float));
        return values;
    }
};

Glb exported(const std::filesystem::path& folder) { return Glb(test::read_file(folder / "turning_poke.glb")); }

// glTF 2.0: 3.6 (binary data), 3.7.2 (meshes, morph targets), 3.11 (animations), 4 (GLB).
TEST(Gltf, AccessorsViewsMeshesAndAnimationsAgreeWithTheSpecification) {
    const test::TemporaryFolder folder;
    const test::ReportedRun run(ExportFormat::gltf, folder.path(), 1);
    const Glb file = exported(folder.path());
    const json& document = file.document;
    EXPECT_EQ(document["asset"]["version"], "2.0");
    ASSERT_EQ(document["buffers"].size(), 1U);
    EXPECT_EQ(document["buffers"][0]["byteLength"], file.binary.size());
    for (const json& view : document["bufferViews"]) {
        EXPECT_EQ(view["buffer"], 0);
        EXPECT_EQ(view["byteOffset"].get<std::size_t>() % 4, 0U);
        EXPECT_LE(view["byteOffset"].get<std::size_t>() + view["byteLength"].get<std::size_t>(), file.binary.size());
        EXPECT_GT(view["byteLength"], 0);
    }
    for (std::size_t i = 0; i < document["accessors"].size(); ++i) {
        const json& accessor = document["accessors"][i];
        const json& view = document["bufferViews"].at(accessor["bufferView"].get<std::size_t>());
        EXPECT_EQ(view["byteLength"], accessor["count"].get<std::size_t>() * Glb::width(accessor) * 4);
        if (!accessor.contains("min")) continue;
        const std::vector<float> values = file.floats(i);
        for (std::size_t c = 0; c < Glb::width(accessor); ++c) {
            float low = values[c];
            float high = values[c];
            for (std::size_t k = c; k < values.size(); k += Glb::width(accessor)) {
                low = std::min(low, values[k]);
                high = std::max(high, values[k]);
            }
            EXPECT_EQ(accessor["min"][c], low);
            EXPECT_EQ(accessor["max"][c], high);
        }
    }
    std::size_t morphing = 0;
    for (const json& mesh : document["meshes"]) {
        for (const json& primitive : mesh["primitives"]) {
            const json& points = document["accessors"].at(primitive["attributes"]["POSITION"].get<std::size_t>());
            EXPECT_TRUE(points.contains("min") && points["type"] == "VEC3");
            const json& indices = document["accessors"].at(primitive["indices"].get<std::size_t>());
            EXPECT_EQ(indices["componentType"], 5125);
            EXPECT_EQ(indices["count"].get<std::size_t>() % 3, 0U);
            const json& view = document["bufferViews"].at(indices["bufferView"].get<std::size_t>());
            EXPECT_EQ(view["target"], 34963);
            for (std::size_t k = 0; k < indices["count"]; ++k) {
                EXPECT_LT(Glb::number(file.binary, view["byteOffset"].get<std::size_t>() + 4 * k), points["count"]);
            }
            EXPECT_LT(primitive["material"], document["materials"].size());
            if (!primitive.contains("targets")) continue;
            ++morphing;
            EXPECT_LE(primitive["targets"].size(), 64U);
            EXPECT_EQ(primitive["targets"].size(), mesh["weights"].size());
            for (const json& target : primitive["targets"]) {
                const json& travel = document["accessors"].at(target["POSITION"].get<std::size_t>());
                EXPECT_EQ(travel["count"], points["count"]);
                EXPECT_TRUE(travel.contains("min"));
            }
        }
    }
    EXPECT_EQ(morphing, 1U) << "tissue alone deforms";
    ASSERT_EQ(document["animations"].size(), 1U);
    std::set<std::string> driven;
    for (const json& channel : document["animations"][0]["channels"]) {
        const json& sampler = document["animations"][0]["samplers"].at(channel["sampler"].get<std::size_t>());
        const std::vector<float> times = file.floats(sampler["input"]);
        EXPECT_TRUE(document["accessors"][sampler["input"].get<std::size_t>()].contains("max"));
        for (std::size_t i = 1; i < times.size(); ++i) EXPECT_GT(times[i], times[i - 1]);
        const std::string path = channel["target"]["path"];
        const json& node = document["nodes"].at(channel["target"]["node"].get<std::size_t>());
        EXPECT_TRUE(driven.insert(path + node["name"].get<std::string>()).second) << "one channel per node and path";
        const std::size_t weights =
            document["meshes"].at(node["mesh"].get<std::size_t>()).value("weights", json::array()).size();
        const std::vector<float> output = file.floats(sampler["output"]);
        EXPECT_EQ(output.size(), times.size() * (path == "weights" ? weights : path == "rotation" ? 4 : 3));
        for (std::size_t i = 0; path == "rotation" && i < output.size(); i += 4) {
            EXPECT_NEAR(std::hypot(std::hypot(output[i], output[i + 1]), std::hypot(output[i + 2], output[i + 3])), 1.0,
                        1e-6);
        }
    }
    EXPECT_EQ(driven, (std::set<std::string>{"rotationtool", "translationtool", "weightssheet"}));
}

TEST(Gltf, EveryFrameIsWhereTheSimulationHasIt) {
    const test::TemporaryFolder folder;
    const test::ReportedRun run(ExportFormat::gltf, folder.path(), 13);
    const Glb file = exported(folder.path());
    const json& document = file.document;
    const json& root = document["nodes"].at(document["scenes"][0]["nodes"][0].get<std::size_t>());
    const auto vector = [](const json& v) { return Vector3(v[0], v[1], v[2]); };
    const auto quaternion = [](const json& v) { return Eigen::Quaterniond(v[3], v[0], v[1], v[2]); };
    std::size_t frame = 0;
    for (const std::int64_t tick : {0, 13, 26, 39}) {
        double farthest = 0.0;
        std::size_t compared = 0;
        for (std::size_t n = 0; n < document["nodes"].size(); ++n) {
            const json& node = document["nodes"][n];
            if (!node.contains("mesh")) continue;
            const json& primitive = document["meshes"][node["mesh"].get<std::size_t>()]["primitives"][0];
            std::vector<float> points = file.floats(primitive["attributes"]["POSITION"]);
            Eigen::Quaterniond turn = Eigen::Quaterniond::Identity();
            Vector3 shift = Vector3::Zero();
            for (const json& channel : document["animations"][0]["channels"]) {
                if (channel["target"]["node"] != n) continue;
                const json& sampler = document["animations"][0]["samplers"].at(channel["sampler"].get<std::size_t>());
                const std::vector<float> output = file.floats(sampler["output"]);
                const std::string path = channel["target"]["path"];
                if (path == "translation")
                    shift = vector(json({output[3 * frame], output[3 * frame + 1], output[3 * frame + 2]}));
                if (path == "rotation") {
                    turn = quaternion(
                        json({output[4 * frame], output[4 * frame + 1], output[4 * frame + 2], output[4 * frame + 3]}));
                }
                if (path != "weights") continue;
                const std::size_t targets = primitive["targets"].size();
                for (std::size_t t = 0; t < targets; ++t) {
                    const std::vector<float> travel = file.floats(primitive["targets"][t]["POSITION"]);
                    for (std::size_t i = 0; i < points.size(); ++i)
                        points[i] += output[frame * targets + t] * travel[i];
                }
            }
            const std::string name = node["name"];
            const BodyRange& body = run.scene.topology.bodies[name == "tool" ? 0 : 1];
            ASSERT_EQ(body.name, name);
            ASSERT_EQ(points.size(), 3U * body.vertices.count);
            // Vertices come in the order in which the triangles name them.
            std::vector<Index> order;
            std::set<Index> seen;
            for (Index t = body.triangles.first; t < body.triangles.end(); ++t) {
                for (int corner = 0; corner < 3; ++corner) {
                    const Index vertex = run.scene.topology.triangles(corner, t);
                    if (seen.insert(vertex).second) order.push_back(vertex);
                }
            }
            for (std::size_t i = 0; i < order.size(); ++i) {
                const Vector3 local = turn * Vector3(points[3 * i], points[3 * i + 1], points[3 * i + 2]) + shift;
                const Vector3 shown = quaternion(root["rotation"]) * local + vector(root["translation"]);
                const Vector3 world = run.ticks.at(tick).position.col(order[i]);
                farthest = std::max(farthest, (shown - Vector3(world.x(), world.z(), -world.y())).norm());
                ++compared;
            }
        }
        EXPECT_EQ(compared, static_cast<std::size_t>(run.scene.topology.vertex_count));
        EXPECT_LT(farthest, 1e-7) << "m, at tick " << tick << "; +Y is up";
        ++frame;
    }
    EXPECT_GT((run.ticks.at(39).position - run.ticks.at(0).position).cwiseAbs().maxCoeff(), 1e-3) << "something moves";
}

TEST(Gltf, WhatOnlyMovesIsANodeAndWhatBendsIsAMeshWhereverTheyLie) {
    Triangles faces(3, 1);
    faces << 0, 1, 2;
    const Topology topology = make_topology(
        {Body{.name = "block", .kind = BodyKind::rigid, .closed = false, .vertex_count = 3, .triangles = faces}});
    const auto primitive_of = [&topology](const Matrix3X& before, const Matrix3X& after) {
        const test::TemporaryFolder folder;
        const auto exporter = gltf_exporter(topology, "two", folder.path());
        PlayedFrame frame;
        for (const std::int64_t tick : {0, 1}) {
            frame.tick = tick;
            frame.time = 0.001 * static_cast<double>(tick);
            frame.position = tick == 0 ? before : after;
            exporter->add(frame);
        }
        exporter->finish();
        return Glb(test::read_file(folder.path() / "two.glb")).document["meshes"][0]["primitives"][0];
    };
    // Its box ends at the origin, and begins there.
    Matrix3X corners(3, 3);
    corners << -1.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, -1.0;
    const Matrix3 turn = Eigen::AngleAxisd(0.3, Vector3(1.0, 2.0, 3.0).normalized()).toRotationMatrix();
    for (const double sign : {1.0, -1.0}) {
        const Matrix3X before = sign * corners;
        const Matrix3X after = (turn * before).colwise() + Vector3(0.1, 0.2, 0.3);
        EXPECT_FALSE(primitive_of(before, after).contains("targets"));
    }
    // A millimetre of a body of a metre that lies two kilometres away.
    const Matrix3X before = corners.colwise() + Vector3(2000.0, 0.0, 0.0);
    Matrix3X after = before;
    after(1, 1) += 1e-3;
    EXPECT_EQ(primitive_of(before, after)["targets"].size(), 1U);
}

TEST(Gltf, OneFrameIsAPictureThatStandsStill) {
    const test::TemporaryFolder folder;
    const test::ReportedRun run(ExportFormat::gltf, folder.path(), 1000);
    const Glb file = exported(folder.path());
    EXPECT_FALSE(file.document.contains("animations"));
    EXPECT_EQ(file.document["meshes"].size(), 2U);
}

}  // namespace
}  // namespace trocar
