#include "geometry/mesh_file.hpp"

#include <fmt/format.h>

#include <array>
#include <bit>
#include <cstdint>
#include <numbers>

#include "geometry/input_error.hpp"
#include "geometry/mesh_text.hpp"
#include "geometry/random.hpp"
#include "geometry/rigid_motion.hpp"
#include "geometry/whole_file.hpp"

namespace trocar {
namespace {

using mesh_text::Source;

using Reader = Mesh (*)(const Source&);

Reader reader_for_extension(const std::string& extension) {
    using mesh_text::equal_without_case;
    if (equal_without_case(extension, ".obj")) return mesh_text::read_obj;
    if (equal_without_case(extension, ".stl")) return mesh_text::read_stl;
    if (equal_without_case(extension, ".ply")) return mesh_text::read_ply;
    if (equal_without_case(extension, ".off")) return mesh_text::read_off;
    if (equal_without_case(extension, ".vtk")) return mesh_text::read_vtk;
    if (equal_without_case(extension, ".vtp")) return mesh_text::read_vtp;
    if (equal_without_case(extension, ".wrl") || equal_without_case(extension, ".vrml")) return mesh_text::read_vrml;
    return nullptr;
}

/// Reader whose magic words open the text; OBJ has none.
Reader reader_for_content(std::string_view text) {
    mesh_text::LineReader lines(text);
    std::string_view rest;
    while (lines.next(rest)) {
        if (rest.starts_with("#VRML")) return mesh_text::read_vrml;
        const std::string_view token = mesh_text::next_token(rest);
        if (token.empty() || token.front() == '#') continue;
        if (token == "ply") return mesh_text::read_ply;
        if (token.ends_with("OFF") && token.size() <= 8) return mesh_text::read_off;
        if (mesh_text::equal_without_case(token, "solid")) return mesh_text::read_stl;
        return nullptr;
    }
    return nullptr;
}

}  // namespace

Mesh read_mesh(const std::filesystem::path& file) {
    const std::string bytes = read_whole(file, "a mesh file");
    Source source{.name = file.string(), .text = bytes};
    if (source.text.starts_with("\x1f\x8b")) {
        mesh_text::fail_byte(source, 0, "an uncompressed mesh", "gzip-compressed data (unpack it with gunzip first)");
    }
    if (source.text.starts_with("\xef\xbb\xbf")) source.text.remove_prefix(3);
    Reader read = reader_for_extension(file.extension().string());
    if (read == nullptr) read = reader_for_content(source.text);
    if (read == nullptr) {
        throw InputError(source.name, "", "a mesh file (.obj .stl .ply .off .vtk .vtp .wrl .vrml)",
                         "the extension '" + file.extension().string() + "' and unknown content");
    }
    return read(source);
}

void write_obj(const std::filesystem::path& file, const Matrix3X& vertices, const Triangles& triangles) {
    fmt::memory_buffer text;
    for (Eigen::Index i = 0; i < vertices.cols(); ++i) {
        fmt::format_to(std::back_inserter(text), "v {:.17g} {:.17g} {:.17g}\n", vertices(0, i), vertices(1, i),
                       vertices(2, i));
    }
    for (Eigen::Index t = 0; t < triangles.cols(); ++t) {
        fmt::format_to(std::back_inserter(text), "f {} {} {}\n", std::int64_t{triangles(0, t)} + 1,
                       std::int64_t{triangles(1, t)} + 1, std::int64_t{triangles(2, t)} + 1);
    }
    write_whole(file, fmt::to_string(text));
}

void pose_vertices(double scale, const Vector3& translation, const Vector3& rotation_degrees, Matrix3X& vertices) {
    const double length = rotation_degrees.norm();
    const Vector3 axis = length > 0.0 ? Vector3(rotation_degrees / length) : Vector3::UnitZ();
    const Matrix3 r = Eigen::AngleAxisd(length * (std::numbers::pi / 180.0), axis).toRotationMatrix();
    vertices *= scale;
    transform_points(r, translation, vertices);
}

void weld(Matrix3X& vertices, Triangles& triangles) {
    const Eigen::Index count = vertices.cols();
    const std::size_t slots = std::bit_ceil(2 * static_cast<std::size_t>(count) + 1);
    std::vector<Index> table(slots, -1);  // open addressing; entries are new vertex numbers
    std::vector<Index> new_number(static_cast<std::size_t>(count));
    Index kept = 0;
    for (Eigen::Index i = 0; i < count; ++i) {
        const Vector3 p = vertices.col(i);
        std::uint64_t hash = 0;
        for (int axis = 0; axis < 3; ++axis) {
            // + 0.0 turns -0 into 0, which compares equal to it.
            hash = (std::rotl(hash, 21) ^ std::bit_cast<std::uint64_t>(p[axis] + 0.0)) * golden_ratio;
        }
        std::size_t slot = static_cast<std::size_t>(hash >> 20U) & (slots - 1);
        while (table[slot] >= 0 && vertices.col(table[slot]) != p) slot = (slot + 1) & (slots - 1);
        if (table[slot] < 0) {
            table[slot] = kept;
            vertices.col(kept) = p;
            ++kept;
        }
        new_number[static_cast<std::size_t>(i)] = table[slot];
    }
    vertices.conservativeResize(Eigen::NoChange, kept);
    for (Eigen::Index k = 0; k < triangles.size(); ++k) {
        Index& corner = triangles.data()[k];
        corner = new_number[static_cast<std::size_t>(corner)];
    }
}

}  // namespace trocar
