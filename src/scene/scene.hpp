// A scene read from JSON (DESIGN §10): flat world, first frame, materials, motions. It builds only what the file names:
// without tissue there are no springs.
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

/// Vertices of an instrument that rotate with the jaw: p = hinge rotation(angle(jaw)), applied before the body pose.
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

/// Time in which the detector answers nothing, so that bodies pass into each other unseen. Script, tissue and contact
/// generator run on. An interval from before tick 0 begins with the scripts alone: the methods start at tick 0, truth
/// at `from`.
struct ContactOff {
    double from = 0.0;  ///< s
    double to = 0.0;    ///< s, > from and >= 0; the first tick with contact
};

struct Scene {
    std::string name;
    std::filesystem::path file;  ///< source file; empty for a scene made in memory
    std::uint64_t hash = 0;      ///< over the scene's content, meshes included
    double dt = 0.001;           ///< s
    std::int64_t ticks = 0;
    std::uint64_t seed = 1;
    std::optional<ContactOff> contact_off = {};
    Topology topology;  ///< bodies sorted by kind
    Frame first;        ///< of tick 0
    Materials materials;
    std::vector<SceneBody> bodies;   ///< as Topology::bodies
    std::vector<std::string> notes;  ///< deviations from the files: "/bodies/…: sentence"
    /// N/m, contact stiffness of all pairs set by a parameter of a study instead of the file; NaN: as in the file.
    double turned_k = std::numeric_limits<double>::quiet_NaN();

    [[nodiscard]] bool has_tissue() const { return !materials.springs.empty(); }
    /// False in the interval `contact_off`.
    [[nodiscard]] bool has_contact_at(std::int64_t tick) const;
    /// Ticks that the scripts do before tick 0; 0 without an interval that begins there.
    [[nodiscard]] std::int64_t prelude_ticks() const;
};

/// Reads and builds a scene. `data` is the folder for "data:PATH" meshes; without it such a mesh is an InputError
/// naming --data. Throws InputError with a JSON pointer for every unknown key, wrong type or impossible value.
Scene read_scene(const std::filesystem::path& file, const std::optional<std::filesystem::path>& data);

/// True if a data: mesh of the scene is missing (a study then has a row `unsupported (no data)`).
bool lacks_data(const std::filesystem::path& file, const std::optional<std::filesystem::path>& data);

/// Writes the vertices of a body at a pose into position (3×N, m, world).
void place_body(const SceneBody& body, Range vertices, const Pose& pose, Matrix3X& position);

/// The frame with every scripted body at its pose at `tick`, which may be negative; all else as in `first`.
Frame scripted_frame(const Scene& scene, std::int64_t tick);

/// Instrument whose force a run shows: the first one with a motion, else the first one, else -1.
Index shown_body(const Scene& scene);

/// Per body, the number of the simulated operator that moves it, counted up in the order of bodies; -1: none. All
/// bodies of one instrument share one operator.
std::vector<Index> operators_of_bodies(const Scene& scene);

/// JSON Schema of scenes, printed by `trocar schema scene`.
std::string scene_schema();

}  // namespace trocar
