#include "export/gltf.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <map>
#include <nlohmann/json.hpp>

#include "geometry/rigid_motion.hpp"
#include "geometry/whole_file.hpp"
#include "scene/mesh_bodies.hpp"

namespace trocar {
namespace {

using Json = nlohmann::ordered_json;
using Floats = std::vector<float>;

// Names of the numbers that the format has for types (glTF 2.0, 3.6.2.2 and 5.11).
constexpr int type_float = 5126;
constexpr int type_unsigned_int = 5125;
constexpr int array_buffer = 34962;
constexpr int element_array_buffer = 34963;

/// A piece of a body that is drawn as one mesh.
struct Part {
    std::string name;
    BodyKind kind = BodyKind::rigid;
    std::vector<Index> vertices = {};         ///< global numbers, in order
    std::vector<std::uint32_t> corners = {};  ///< three a triangle, numbers into `vertices`
};

/// Connected triangles of bodies that do not deform, one part each; a tissue body is one part.
std::vector<Part> parts_of(const Topology& topology) {
    const std::vector<Index> component = component_of_triangle(topology.triangles, topology.vertex_count);
    std::vector<Part> parts;
    std::vector<std::int64_t> number(static_cast<std::size_t>(topology.vertex_count), -1);
    for (const BodyRange& body : topology.bodies) {
        std::map<Index, std::size_t> part_of_component;
        for (Index t = body.triangles.first; t < body.triangles.end(); ++t) {
            const bool deforms = body.kind == BodyKind::tissue;
            const auto [found, is_new] = part_of_component.try_emplace(deforms ? -1 : component[at(t)], parts.size());
            if (is_new) {
                const std::size_t before = part_of_component.size() - 1;
                parts.push_back(
                    {.name = before == 0 ? body.name : fmt::format("{} {}", body.name, before + 1), .kind = body.kind});
            }
            Part& part = parts[found->second];
            for (int corner = 0; corner < 3; ++corner) {
                const Index vertex = topology.triangles(corner, t);
                std::int64_t& place = number[static_cast<std::size_t>(vertex)];
                if (place < 0) {
                    place = static_cast<std::int64_t>(part.vertices.size());
                    part.vertices.push_back(vertex);
                }
                part.corners.push_back(static_cast<std::uint32_t>(place));
            }
        }
    }
    return parts;
}

/// The one binary buffer and what the document says of its pieces.
class Buffer {
public:
    /// `width` numbers an element, with their smallest and largest values where `bounds`.
    int add(const Floats& values, std::size_t width, bool bounds, int target = 0) {
        Json accessor{{"bufferView", view(values.data(), values.size() * sizeof(float), target)},
                      {"componentType", type_float},
                      {"count", values.size() / width},
                      {"type", width == 1   ? "SCALAR"
                               : width == 3 ? "VEC3"
                                            : "VEC4"}};
        if (bounds) {
            Floats low(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(width));
            Floats high = low;
            for (std::size_t i = width; i < values.size(); ++i) {
                low[i % width] = std::min(low[i % width], values[i]);
                high[i % width] = std::max(high[i % width], values[i]);
            }
            accessor["min"] = low;
            accessor["max"] = high;
        }
        return append(std::move(accessor));
    }
    int add_corners(const std::vector<std::uint32_t>& corners) {
        return append(
            {{"bufferView", view(corners.data(), corners.size() * sizeof(std::uint32_t), element_array_buffer)},
             {"componentType", type_unsigned_int},
             {"count", corners.size()},
             {"type", "SCALAR"}});
    }
    [[nodiscard]] const std::string& bytes() const { return bytes_; }
    void describe(Json& document) const {
        document["buffers"] = Json::array({Json{{"byteLength", bytes_.size()}}});
        document["bufferViews"] = views_;
        document["accessors"] = accessors_;
    }

private:
    int append(Json accessor) {
        accessors_.push_back(std::move(accessor));
        return static_cast<int>(accessors_.size()) - 1;
    }
    std::size_t view(const void* data, std::size_t size, int target) {
        Json one{{"buffer", 0}, {"byteOffset", bytes_.size()}, {"byteLength", size}};
        if (target != 0) one["target"] = target;
        views_.push_back(std::move(one));
        bytes_.append(static_cast<const char*>(data), size);
        return views_.size() - 1;
    }
    std::string bytes_;  // every number has four bytes, so that every piece begins at a multiple of four
    Json views_ = Json::array();
    Json accessors_ = Json::array();
};

/// glb container (glTF 2.0, 4): head, JSON chunk, binary chunk; each padded to a multiple of four.
std::string to_glb(const Json& document, const std::string& binary) {
    std::string text = document.dump(-1, ' ', false, Json::error_handler_t::replace);
    text.append((4 - text.size() % 4) % 4, ' ');
    std::string bytes;
    const auto number = [&bytes](std::size_t value) {
        const auto word = static_cast<std::uint32_t>(value);
        for (unsigned shift = 0; shift < 32; shift += 8) bytes += static_cast<char>(word >> shift & 0xffU);
    };
    number(0x46546C67);  // "glTF"
    number(2);
    number(12 + 8 + text.size() + 8 + binary.size());
    number(text.size());
    number(0x4E4F534A);  // "JSON"
    bytes += text;
    number(binary.size());
    number(0x004E4942);  // "BIN"
    return bytes + binary;
}

Json material(const char* name, const std::array<double, 3>& colour, double metallic, double roughness) {
    return {{"name", name},
            {"pbrMetallicRoughness",
             {{"baseColorFactor", {colour[0], colour[1], colour[2], 1.0}},
              {"metallicFactor", metallic},
              {"roughnessFactor", roughness}}},
            {"doubleSided", true}};
}

class GltfExporter final : public Exporter {
public:
    GltfExporter(const Topology& topology, const std::string& name, std::filesystem::path folder)
        : name_(name), folder_(std::move(folder)), parts_(parts_of(topology)) {}

    void add(const PlayedFrame& frame) override { frames_[frame.tick] = {frame.time, frame.position}; }

    void finish() override {
        const Matrix3X& first = frames_.begin()->second.position;
        const Box box = box_of(first, Range{0, static_cast<Index>(first.cols())});
        middle_ = first.cols() > 0 ? Vector3(0.5 * (box.min + box.max)) : Vector3::Zero();
        size_ = first.cols() > 0 ? (box.max - box.min).norm() : 0.0;
        Floats times;
        for (const auto& [tick, frame] : frames_) {
            times.push_back(static_cast<float>(frame.time - frames_.begin()->second.time));
        }
        times_ = frames_.size() > 1 ? buffer_.add(times, 1, true) : -1;
        Json children = Json::array();
        for (const Part& part : parts_) {
            children.push_back(nodes_.size());
            add_part(part);
        }
        const double half = std::sqrt(0.5);  // a quarter turn about x brings z up to y
        const Vector3 place = Eigen::Quaterniond(half, -half, 0.0, 0.0) * middle_;
        Json root{
            {"name", name_}, {"rotation", {-half, 0.0, 0.0, half}}, {"translation", {place.x(), place.y(), place.z()}}};
        if (!children.empty()) root["children"] = children;
        nodes_.push_back(root);
        Json document{{"asset", {{"version", "2.0"}, {"generator", "trocar"}}},
                      {"scene", 0},
                      {"scenes", Json::array({Json{{"name", name_}, {"nodes", Json::array({nodes_.size() - 1})}}})},
                      {"nodes", nodes_}};
        if (!meshes_.empty()) {
            document["meshes"] = meshes_;
            // In the order of BodyKind.
            document["materials"] = {material("instrument", {0.55, 0.58, 0.62}, 0.8, 0.35),
                                     material("rigid", {0.89, 0.85, 0.75}, 0.0, 0.8),
                                     material("tissue", {0.78, 0.38, 0.34}, 0.0, 0.6)};
        }
        if (!channels_.empty()) {
            document["animations"] =
                Json::array({Json{{"name", name_}, {"channels", channels_}, {"samplers", samplers_}}});
        }
        if (!buffer_.bytes().empty()) buffer_.describe(document);
        write_whole(folder_ / (file_word(name_) + ".glb"), to_glb(document, buffer_.bytes()));
    }

private:
    struct Held {
        double time = 0.0;  ///< s
        Matrix3X position;
    };

    /// m, from the middle of the first frame.
    [[nodiscard]] Matrix3X points_of(const Part& part, const Matrix3X& position) const {
        Matrix3X points(3, static_cast<Eigen::Index>(part.vertices.size()));
        for (std::size_t i = 0; i < part.vertices.size(); ++i) {
            points.col(static_cast<Eigen::Index>(i)) = position.col(part.vertices[i]) - middle_;
        }
        return points;
    }

    static Floats floats_of(const Matrix3X& points) {
        const Eigen::MatrixXf narrow = points.cast<float>();
        return {narrow.data(), narrow.data() + narrow.size()};
    }

    void add_part(const Part& part) {
        const Matrix3X base = points_of(part, frames_.begin()->second.position);
        Json primitive{{"attributes", {{"POSITION", buffer_.add(floats_of(base), 3, true, array_buffer)}}},
                       {"indices", buffer_.add_corners(part.corners)},
                       {"material", static_cast<int>(part.kind)}};
        Json mesh{{"name", part.name}};
        Json node{{"name", part.name}, {"mesh", meshes_.size()}};
        if (times_ >= 0) {
            std::vector<RigidMotion> motions;
            double error = part.kind == BodyKind::tissue ? std::numeric_limits<double>::infinity() : 0.0;
            for (auto frame = frames_.begin(); frame != frames_.end() && std::isfinite(error); ++frame) {
                const Matrix3X there = points_of(part, frame->second.position);
                const RigidMotion& motion = motions.emplace_back(rigid_motion(base, there));
                const Matrix3X moved = (motion.rotation * base).colwise() + motion.translation;
                error = std::max(error, (moved - there).colwise().norm().maxCoeff());
            }
            // What 32-bit numbers would lose anyway.
            constexpr double share_of_size = 1e-6;
            if (error <= share_of_size * size_) {
                move(motions, node);
            } else {
                morph(part, base, primitive, mesh);
            }
        }
        mesh["primitives"] = Json::array({primitive});
        meshes_.push_back(mesh);
        nodes_.push_back(node);
    }

    void add_channel(const char* path, int output) {
        channels_.push_back({{"sampler", samplers_.size()}, {"target", {{"node", nodes_.size()}, {"path", path}}}});
        samplers_.push_back({{"input", times_}, {"interpolation", "LINEAR"}, {"output", output}});
    }

    void move(const std::vector<RigidMotion>& motions, Json& node) {
        Floats rotation;
        Floats translation;
        double largest = 0.0;
        Quaternion before = Quaternion::Identity();
        for (const RigidMotion& motion : motions) {
            Quaternion turned = Quaternion(motion.rotation).normalized();
            // The shorter rotation between two keys.
            if (turned.dot(before) < 0.0) turned.coeffs() *= -1.0;
            before = turned;
            for (int c = 0; c < 4; ++c) rotation.push_back(static_cast<float>(turned.coeffs()[c]));
            for (int c = 0; c < 3; ++c) translation.push_back(static_cast<float>(motion.translation[c]));
            largest = std::max({largest, motion.translation.norm(), turned.vec().norm()});
        }
        if (largest == 0.0) return;
        node["rotation"] = {rotation[0], rotation[1], rotation[2], rotation[3]};
        node["translation"] = {translation[0], translation[1], translation[2]};
        add_channel("rotation", buffer_.add(rotation, 4, false));
        add_channel("translation", buffer_.add(translation, 3, false));
    }

    void morph(const Part& part, const Matrix3X& base, Json& primitive, Json& mesh) {
        const std::size_t targets = frames_.size() - 1;
        Json names = Json::array();
        primitive["targets"] = Json::array();
        for (auto frame = std::next(frames_.begin()); frame != frames_.end(); ++frame) {
            const Matrix3X path = points_of(part, frame->second.position) - base;
            primitive["targets"].push_back({{"POSITION", buffer_.add(floats_of(path), 3, true, array_buffer)}});
            names.push_back(fmt::format("tick {}", frame->first));
        }
        mesh["weights"] = Floats(targets, 0.0F);
        mesh["extras"] = {{"targetNames", names}};
        Floats weights(targets * frames_.size(), 0.0F);
        for (std::size_t i = 0; i < targets; ++i) weights[(i + 1) * targets + i] = 1.0F;
        add_channel("weights", buffer_.add(weights, 1, false));
    }

    std::string name_;
    std::filesystem::path folder_;
    std::vector<Part> parts_;
    std::map<std::int64_t, Held> frames_;  ///< by tick
    Vector3 middle_ = Vector3::Zero();     ///< m, of the first frame's box
    double size_ = 0.0;                    ///< m, its diagonal
    Buffer buffer_;
    int times_ = -1;  ///< accessor; -1: one frame, nothing moves
    Json nodes_ = Json::array();
    Json meshes_ = Json::array();
    Json channels_ = Json::array();
    Json samplers_ = Json::array();
};

}  // namespace

std::unique_ptr<Exporter> gltf_exporter(const Topology& topology, const std::string& name,
                                        const std::filesystem::path& folder) {
    return std::make_unique<GltfExporter>(topology, name, folder);
}

}  // namespace trocar
