// Data of a page from one run: every number of every tick, every n-th frame, and the frames with the largest values.
// Playback supplies the frames one by one.
#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "playback/playback.hpp"
#include "scene/world.hpp"

namespace trocar {

struct ViewedContact {
    Vector3 point = Vector3::Zero();  ///< m, world
    Vector3 force = Vector3::Zero();  ///< N, on the body that is pushed; 0: unknown
};

struct ViewedFrame {
    std::int64_t tick = -1;
    Matrix3X position;  ///< 3×N, m, world
    /// m, one per tissue vertex in ascending order, >= 0: the larger of two depths. One is its own depth; the other
    /// that of the deepest penetrating vertex of another body nearest to it. 0 where the side is undecided.
    std::vector<double> depth;
    std::vector<double> strain;  ///< 1, likewise, absolute value
    std::vector<ViewedContact> contacts;
    /// m, world: mean of the tool's contact points, weighted by force; NaN without a force.
    Vector3 tool_point = Vector3::Constant(std::numeric_limits<double>::quiet_NaN());
};

/// Largest value of a run and its tick.
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
    std::string note;  ///< notice for the reader, e.g. that frames differ from those of the record; may be empty
    std::vector<ViewedFrame> frames;     ///< ascending ticks
    std::vector<Vector3> force;          ///< N, on the tool, every tick; NaN: none
    std::vector<double> depth;           ///< m, residual penetration after every tick; NaN: none
    std::vector<std::int64_t> contacts;  ///< number offered by the contact generator, every tick; -1: not known
    LargestValue worst_depth;            ///< m, over every tick
    LargestValue worst_force;            ///< N, likewise
    double depth_max = 0.0;              ///< m, of a tissue vertex, over every tick
    double strain_max = 0.0;             ///< 1, absolute value, likewise
    double displacement_max = 0.0;       ///< m, likewise
    double contact_force_max = 0.0;      ///< N, of one contact, likewise
};

class RunCapture {
public:
    /// Keeps every `stride`-th tick. `judged`: residual penetration is that of the row, else of the deepest vertex.
    /// `tool`: body whose force is shown; -1: none. The topology outlives the object.
    RunCapture(const Topology& topology, std::int64_t stride, bool judged, Index tool = -1);
    /// Call with every tick.
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
