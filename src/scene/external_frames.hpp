// Frames of other groups' data sets as bodies of this project, with the answers that come with them. docs/STUDIES.md
// names the sets.
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <vector>

#include "scene/mesh_pair.hpp"
#include "scene/world.hpp"

namespace trocar {

struct ExternalFrames {
    Topology topology;
    /// At least one. With `meeting`: two, and the second one's `previous` is the first.
    std::vector<Frame> frames;
    /// Pairs of triangles, first < second, that meet at some time between the two frames by the source's own answers;
    /// sorted.
    std::optional<std::vector<std::array<Index, 2>>> meeting;
};

/// A scene of Sample-Scalable-CCD-Data (Belgrod et al. 2023): a folder with two meshes in `frames`, candidates in
/// `boxes` and their answers in `mma_bool`. Connected components become bodies that are tested against each other.
/// Candidates within one component are left out. Throws InputError with the file.
ExternalFrames read_scalable_ccd(const std::filesystem::path& folder);

/// A scenario of FCL's test models: two objects and their poses, one frame per pose. Throws InputError with the line.
ExternalFrames read_fcl_scenario(const std::filesystem::path& file);

/// A vertex against a face or an edge against an edge. Vertex and edge are triangles with repeated corners.
struct ContinuousQuery {
    MeshPair start;
    Frame end;              ///< `previous` is the start
    bool collides = false;  ///< at some time of the motion, by the source's answer
};

/// A file of Sample-Queries (Wang et al. 2021) in a folder `vertex-face` or `edge-edge`. Throws InputError with the
/// line.
std::vector<ContinuousQuery> read_ccd_queries(const std::filesystem::path& file);

}  // namespace trocar
