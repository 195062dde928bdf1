// Which points of instruments, bones and other tissue are on the wrong side of a tissue surface, by history (METHODS
// §9.2): it works on open sheets, for a tool that stands still, withdraws or is dragged, where depth below one plane
// says nothing.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "contact/contact_set.hpp"
#include "respond/penetration.hpp"
#include "respond/surface.hpp"
#include "respond/surface_blocks.hpp"
#include "respond/tissue_scale.hpp"
#include "respond/triangle_grid.hpp"
#include "scene/world.hpp"

namespace trocar {

/// Counts signed crossings per sample and tissue body. The motion of a tick is taken as tissue first, tool second; the
/// tissue's motion as its vertices moving one after the other in order of their numbers, which sweeps tetrahedra whose
/// faces neighbours share. With exact orientation signs every crossing is thus counted exactly once, whatever edge it
/// passes, so that the count is the exact side.
class CrossingLedger {
public:
    /// `on_edges`: the samples are the vertices, and for instruments and rigid bodies also points on edges longer than
    /// the tissue's, half such an edge apart; without them a shaft thinner than the tissue's mesh passes through
    /// between its own vertices. `scales`: of all bodies.
    void prepare(const Topology& topology, const std::vector<TissueScale>& scales, bool on_edges);
    /// Advances the counts from the last call's frame to this one. The first call finds the start state: on closed
    /// tissue by the winding number; on open tissue a body that crosses the sheet at the start belongs on the side that
    /// the scene declares (BodyRange::start_side), and its vertices on the other side of the crossing count from the
    /// start; a body that does not cross belongs where it is. `contacts` tells which bodies cross.
    void update(const Topology& topology, const SurfaceNeighbours& surface, const Frame& frame,
                const ContactSet& contacts);
    /// Samples on the wrong side, and those that have come back but are within the margin (TissueScale) of the surface,
    /// in a fixed order. The latter keep a resting contact from being lost and found again every other tick.
    [[nodiscard]] std::vector<Penetration>& penetrations() { return penetrations_; }
    [[nodiscard]] const std::vector<Penetration>& penetrations() const { return penetrations_; }
    /// Those of a vertex with a tissue body, one a layer.
    [[nodiscard]] std::span<const Penetration> layers(Index vertex, Index tissue) const;
    /// Those of the samples between two vertices with a tissue body.
    [[nodiscard]] std::span<const Penetration> layers_on_edge(Index u, Index v, Index tissue) const;
    /// All points that it follows, those of a body's vertices one after the other, those on its edges too. From the
    /// first update on.
    [[nodiscard]] std::span<const LedgerSample> samples() const { return samples_; }
    /// True when this one of the samples has not crossed the tissue and is not held near it either. The two bodies are
    /// tested against each other.
    [[nodiscard]] bool is_free(Index sample, Index tissue) const;
    /// Calls visit(triangle) for the tissue's triangles whose boxes meet the box, which may reach from a vertex that is
    /// followed as far as two of the tissue's edges.
    template <typename Visit>
    void visit_near(Index tissue, const Box& box, const Visit& visit) {
        if (Tissue* one = tissue_of(tissue)) one->grid.visit(box, visit);
    }
    /// Signed crossings of a sample with a tissue body since the start (front to back +1), start state included.
    [[nodiscard]] int count(Index vertex, Index tissue) const;
    /// Counts put right since prepare: by the periodic check against the winding number of closed tissue, for which
    /// every sample comes up once in check_period ticks, and where a free rim has slipped past samples.
    [[nodiscard]] std::int64_t repairs() const { return repairs_; }
    static constexpr std::int64_t check_period = 64;  ///< ticks

private:
    struct Crossing {
        Index sample = -1;
        Index triangle = -1;
        int sign = 0;  ///< front to back +1
    };
    struct Tissue {
        Index body = -1;
        bool closed = false;
        double edge = 0.0;    ///< m, mean at rest
        double margin = 0.0;  ///< m
        double clear = 0.0;   ///< m, a depth that counts as none
        SurfaceBlocks blocks;
        std::vector<Box> regions;  ///< per body whose vertices are samples: where the grid is asked
        std::vector<Index> near;   ///< triangles that the grid holds
        TriangleGrid grid;
        bool whole = false;  ///< the grid holds all triangles
        double largest_move = 0.0;
        std::vector<std::int16_t> count;        ///< per sample
        std::vector<Range> layers;              ///< per sample: in penetrations_
        std::vector<Crossing> crossings;        ///< of this tick, by sample
        std::vector<std::array<Index, 2>> rim;  ///< edges that belong to one triangle
    };
    /// Samples are tracked at a point a hair beside the vertex, always the same way, so that no path runs exactly
    /// through an edge of a regular mesh.
    static inline const Vector3 hair{1.37e-11, -2.91e-11, 2.23e-11};
    /// Of a sample in this tick: whether a rim has slipped past it.
    enum class Reach : std::uint8_t { unknown, looked_at, freed };
    /// An edge with samples on it, u < v.
    struct SampledEdge {
        Index u = -1;
        Index v = -1;
        Range samples;
    };

    void add_edge_samples(const Topology& topology, const Frame& frame);
    void find_start(const Topology& topology, const Frame& frame, const ContactSet& contacts);
    void find_start_by_crossings(const Topology& topology, const Frame& frame, Tissue& tissue, Index body);
    [[nodiscard]] static int crossings(const Topology& topology, const Frame& frame, Tissue& tissue,
                                       const Vector3& from, const Vector3& to);
    void check_closed(const Topology& topology, const Frame& frame, Tissue& tissue);
    void count_crossings(const Topology& topology, const Frame& frame, Tissue& tissue);
    void count_crossings_of(std::size_t s, const Topology& topology, const Frame& frame, Tissue& tissue);
    void link_samples(const Topology& topology, const SurfaceNeighbours& surface);
    void free_slipped(const Topology& topology, const Frame& frame, Tissue& tissue);
    [[nodiscard]] bool free_rim_is_near(const Frame& frame, const Tissue& tissue) const;
    [[nodiscard]] static Vector3 outwards_at(const LedgerSample& sample, const Topology& topology,
                                             const SurfaceNeighbours& surface, const Frame& frame);
    void free_group(std::size_t first, const Topology& topology, const Frame& frame, Tissue& tissue);
    /// Null where the body is no tissue.
    [[nodiscard]] const Tissue* tissue_of(Index body) const;
    [[nodiscard]] Tissue* tissue_of(Index body);
    [[nodiscard]] const SampledEdge* sampled_edge(Index u, Index v) const;
    [[nodiscard]] bool is_joined_to_right(std::size_t s, const Topology& topology, const SurfaceNeighbours& surface,
                                          const Frame& frame, Tissue& tissue) const;
    void update_layers(const Topology& topology, const SurfaceNeighbours& surface, const Frame& frame, Tissue& tissue);
    void find_regions(const Topology& topology, const Frame& frame, Tissue& tissue);
    void fill_near(const Topology& topology, const Frame& frame, Tissue& tissue);
    void fill_whole(const Topology& topology, const Frame& frame, Tissue& tissue);
    [[nodiscard]] Index nearest_triangle(const Topology& topology, const Frame& frame, Tissue& tissue,
                                         const Vector3& point);

    std::vector<Tissue> tissues_;
    std::vector<LedgerSample> samples_;
    std::vector<Index> sample_of_vertex_;
    std::vector<SampledEdge> edges_;  ///< sorted
    bool on_edges_ = false;
    std::vector<Index> first_link_;  ///< samples + 1
    std::vector<Index> link_;        ///< per sample those that an edge of its body leads to next; none on tissue
    std::vector<Reach> reach_;       ///< per sample
    std::vector<Index> crossed_;     ///< samples whose count is not zero
    std::vector<Index> group_;
    std::vector<std::uint8_t> tested_;  ///< bodies × bodies
    Matrix3X last_;                     ///< 3×N, positions at the last call
    Matrix3X original_;                 ///< 3×N, positions at the first call
    std::int64_t last_tick_ = -1;
    std::vector<Range> moved_;  ///< vertices that may have moved since the last call
    bool started_ = false;
    std::int64_t updates_ = 0;
    std::int64_t repairs_ = 0;
    std::vector<Penetration> penetrations_;
    std::vector<Penetration> kept_;
    SampleLayers layers_;
};

}  // namespace trocar
