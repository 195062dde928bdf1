// Velocity back-projection of thesis §3.4.5 as METHODS §9.1 makes it executable: from each instrument vertex back along
// its velocity; tissue vertices at the surfaces it has passed attract it and are attracted. Says nothing for a tool at
// rest, and on withdrawal looks the wrong way.
#pragma once

#include <vector>

#include "respond/thesis_state.hpp"
#include "respond/triangle_grid.hpp"

namespace trocar {

class BackProjection {
public:
    void respond(const ThesisState& state, const Frame& frame, Effect& effect);

private:
    /// Where an instrument vertex came from, straight back along its velocity.
    struct Path {
        Index body = -1;
        Index vertex = -1;
        Vector3 from = Vector3::Zero();
        Box box = {};
    };
    void attract(const ThesisState& state, const Frame& frame, const Path& path, Index triangle, Effect& effect);

    std::vector<Path> paths_;
    std::vector<Index> near_;
    TriangleGrid grid_;
    std::vector<Index> crossed_;
    std::vector<Index> attracted_;
};

}  // namespace trocar
