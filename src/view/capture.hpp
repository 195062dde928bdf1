// What a page needs from a run: every number of every tick, and the frames that are drawn, every n-th and the worst
// ones. Fed frame by frame by playback.
#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "playback/playback.hpp"
#include "scene/world.hpp"

namespace trocar {

/// A contact as it is drawn.
struct ViewedContact {
    Vector3 point = Vector3::Zero();  ///< m, world
    Vector3 force = Vector3::Zero();  ///< N, on the body that is pushed; 0: none is reported
};

struct ViewedFrame {
    std::int64_t tick = -1;
    Matrix3X position;  ///< 3×N, m, world
    /// m, one per tissue vertex in ascending order, >= 0: how deep it is inside something, or the deepest vertex of
    /// another body that is inside or beyond the tissue and nearest to it; 0 where truth leaves the side open.
    std::vector<double> depth;
    std::vector<double> strain;  ///< 1, likewise, >= 0: by size
    std::vector<ViewedContact> contacts;
    /// m, world: mean of the contacts of the tool by their force; NaN where none has one.
    Vector3 tool_point = Vector3::Constant(std::numeric_limits<double>::quiet_NaN());
};

/// The largest value of a run and its tick.
struct LargestValue {
    std::int64_t tick = -1;  ///< -1: none
    double value = 0.0;
};

/// One run as a page shows it.
struct ViewedRun {
    std::string label;
    std::string methods;  ///< detector, response, contact generator, stepper, in one line
    std::string outcome = "ok";
    std::string message;
    std::string note;  ///< what a reader must know first, e.g. that frames are not those of the record; may be empty
    std::vector<ViewedFrame> frames;     ///< ascending ticks
    std::vector<Vector3> force;          ///< N, on the tool, every tick; NaN: none
    std::vector<double> depth;           ///< m, left after every tick; NaN: none
    std::vector<std::int64_t> contacts;  ///< reported by the source, every tick; -1: nobody was asked
    LargestValue worst_depth;            ///< m, over every tick
    LargestValue worst_force;            ///< N, likewise
    double depth_max = 0.0;              ///< m, of a tissue vertex, over every tick
    double strain_max = 0.0;             ///< 1, by size, likewise
    double displacement_max = 0.0;       ///< m, likewise
    double contact_force_max = 0.0;      ///< N, of one contact, likewise
};

class RunCapture {
public:
    /// Every `stride`-th tick is kept. `judged`: the residual penetration is the row's, else the deepest vertex'. The
    /// topology outlives the object. `tool`: body whose force is shown; -1: none.
    RunCapture(const Topology& topology, std::int64_t stride, bool judged, Index tool = -1);
    /// To be fed every tick.
    void see(const PlayedFrame& frame);
    /// The run without label, outcome and note.
    ViewedRun finish();

private:
    [[nodiscard]] ViewedFrame kept(const PlayedFrame& frame) const;
    void sink_into_tissue(const PlayedFrame& frame, std::vector<double>& depth) const;

    std::int64_t stride_;
    bool judged_;
    Index tool_;
    std::vector<Index> tissue_;  ///< vertex numbers
    std::vector<Index> others_;  ///< vertex numbers of what is no tissue
    ViewedRun run_;
    ViewedFrame deepest_;
    ViewedFrame strongest_;
    ViewedFrame last_;
};

/// Vertices of all tissue bodies in ascending order.
std::vector<Index> tissue_vertices(const Topology& topology);

}  // namespace trocar
