// A scene as a value read from JSON (DESIGN §10): flat world, first frame, materials, motions. It builds only what the
// file names: no tissue in the file means no springs.
#pragma once

#include <cstdint>
#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "scene/motion.hpp"
#include "scene/world.hpp"

namespace trocar {

/// Vertices of an instrument that swing with the jaw: p = hinge rotation(angle(jaw)) applied before the body pose.
struct JawPart {
    Range vertices;                   ///< global vertex numbers
    Vector3 hinge = Vector3::Zero();  ///< m, body frame
    Vector3 axis = Vector3::UnitX();  ///< unit, body frame
    double angle_open_degrees = 0.0;  ///< added rotation at jaw = 1; linear in between, 0 at jaw = 0
};

struct SceneBody {
    std::optional<Motion> motion;  ///< absent: fixed at its pose
    Matrix3X local;                ///< 3×n, m, body frame (part poses applied, jaw closed)
    std::vector<JawPart> jaws;
    /// Map from the body's own numbering to the file's (identity when nothing is renumbered or left out).
    std::vector<Index> file_vertex;
    std::vector<Index> file_triangle;
};

struct Scene {
    std::string name;
    std::filesystem::path file;  ///< where it was read from; empty for a scene made in memory
    std::uint64_t hash = 0;      ///< over the scene's content, meshes included
    double dt = 0.001;           ///< s
    std::int64_t ticks = 0;
    std::uint64_t seed = 1;
    Topology topology;  ///< bodies sorted by kind
    Frame first;
    Materials materials;
    std::vector<SceneBody> bodies;   ///< as Topology::bodies
    std::vector<std::string> notes;  ///< what was made otherwise than its files have it: "/bodies/…: sentence"
    /// N/m, of every contact where a study's knob has put it in place of what the file says; NaN: as the file says.
    double turned_k = std::numeric_limits<double>::quiet_NaN();

    [[nodiscard]] bool has_tissue() const { return !materials.springs.empty(); }
};

/// Reads and builds. `data` is the folder for "data:PATH" meshes; without it such a mesh is an InputError naming
/// --data. Throws InputError with a JSON pointer for every unknown key, wrong type or impossible value.
Scene read_scene(const std::filesystem::path& file, const std::optional<std::filesystem::path>& data);

/// True when the scene names a data: mesh that is not there (a study then has a row `unsupported (no data)`).
bool lacks_data(const std::filesystem::path& file, const std::optional<std::filesystem::path>& data);

/// Writes the body's vertices for a pose into position (3×N, world).
void place_body(const SceneBody& body, Range vertices, const Pose& pose, Matrix3X& position);

/// JSON Schema documents printed by `trocar schema scene|study|recording`.
std::string scene_schema();

}  // namespace trocar
