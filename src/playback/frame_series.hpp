// Frames of another simulator, read one at a time: mesh files per frame, NumPy archives, ParaView's lists of files, and
// recordings.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <vector>

#include "simulate/frame_source.hpp"

namespace trocar {

/// How the surface of an input becomes bodies.
enum class BodyRule : std::uint8_t {
    given,       ///< array body_ids of an .npz file where there is one; else the surface is one body
    components,  ///< connected components, by vertex numbers
    objects      ///< objects (o) of OBJ files, else their groups (g)
};

struct SeriesChoice {
    double unit = not_known;        ///< m, of the inputs' coordinates; not for a recording, which has its own
    double frame_time = not_known;  ///< s, from frame to frame; times are unknown without it; likewise
    BodyRule bodies = BodyRule::given;
};

/// Frames of all inputs together. An input is one of:
///
/// - a folder with a mesh file per frame, or with a folder per frame. Names differ in the last number only, which
///   ascends in equal steps. Several names are several surfaces.
/// - an .npz file with `positions` [T, V, 3], `faces` [F, 3] and maybe `body_ids` [V] or [F].
/// - a .pvd or .series file: a list of mesh files. Its times are not read.
/// - a mesh file: a surface that stands still.
/// - a recording, by itself.
///
/// A surface whose rims close (vertices at one place count as one) is a closed body, every other one an open sheet.
/// Surfaces that stand still beside moving ones are rigid, all others tissue. Throws InputError for input that cannot
/// be read, and for surfaces without a triangle. next() throws InputError too, for a frame whose triangles are not
/// those of the first one and for one that is not finite.
std::unique_ptr<FrameSource> frame_series(const std::vector<std::filesystem::path>& inputs, const SeriesChoice& choice);

}  // namespace trocar
