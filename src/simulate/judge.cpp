#include "simulate/judge.hpp"

#include <algorithm>
#include <cmath>

#include "measure/pair_truth.hpp"

namespace trocar {

void add_depth(const DepthTruth::Result& left, StepRow& row) {
    row.residual_penetration = left.residual_penetration;
    row.residual_penetration_mean = left.residual_penetration_mean;
    row.wrong_side = left.wrong_side;
    row.wrong_side_area = left.wrong_side_area;
    row.wrong_side_vertices = left.wrong_side_vertices;
    row.side_undecided = left.side_undecided;
}

Judge::Judge(const Topology& topology, const Frame& first, std::span<const std::uint8_t> yielding,
             const Materials* materials)
    : topology_(&topology),
      materials_(materials),
      yielding_(yielding.begin(), yielding.end()),
      anything_yields_(std::any_of(yielding.begin(), yielding.end(), [](std::uint8_t flag) { return flag != 0; })),
      depth_(topology, first, yielding) {}

/// Depth of the entering vertex where the contact names one. For contacts of libraries, depth of the deepest corner of
/// both triangles. NaN without a depth.
double Judge::true_depth(const Contact& contact) const {
    if (contact.a < 0 || contact.b < 0 || !std::isfinite(contact.depth)) return not_known;
    const Index body_a = topology_->body_of_triangle[static_cast<std::size_t>(contact.a)];
    const Index body_b = topology_->body_of_triangle[static_cast<std::size_t>(contact.b)];
    switch (contact.kind) {
        case ContactCase::a_enters_b:
            return contact.vertex_a < 0 ? not_known : depth_.depth_of_vertex(contact.vertex_a, body_b);
        case ContactCase::b_enters_a:
            return contact.vertex_b < 0 ? not_known : depth_.depth_of_vertex(contact.vertex_b, body_a);
        case ContactCase::unset: {
            double deepest = 0.0;
            for (int corner = 0; corner < 3; ++corner) {
                // A corner whose side is undecided has no depth (NaN).
                for (const double depth : {depth_.depth_of_vertex(topology_->triangles(corner, contact.a), body_b),
                                           depth_.depth_of_vertex(topology_->triangles(corner, contact.b), body_a)}) {
                    deepest = std::fmax(deepest, depth);
                }
            }
            return deepest;
        }
        case ContactCase::edges_cross:
        case ContactCase::touch:
        case ContactCase::coplanar:
        case ContactCase::degenerate:
        case ContactCase::point_face:
        case ContactCase::edge_edge:
            return not_known;
    }
    return not_known;
}

double Judge::worst_error(std::span<const Contact> contacts) const {
    double worst = not_known;
    for (const Contact& contact : contacts) {
        worst = std::fmax(worst, std::abs(contact.depth - true_depth(contact)));
    }
    return worst;
}

void Judge::judge_detection(const Frame& seen, const ContactSet& contacts, StepRow& row, bool in_detail) {
    const TickTruth truth = truth_of(*topology_, seen);
    judge_pairs(truth, contacts.pairs, row);
    const std::vector<TrianglePair> deepest = deepest_pairs(*topology_, seen, truth.pairs);
    row.deepest_pairs = static_cast<std::int64_t>(deepest.size());
    row.deepest_false_negatives = compare_pairs(contacts.pairs, deepest, {}).false_negatives;
    if (!in_detail) return;
    if (row.query_distance > 0.0) {
        std::vector<TrianglePair> near;
        true_near_pairs(*topology_, seen, row.query_distance, near);
        row.true_proximity_pairs = static_cast<std::int64_t>(near.size());
        row.proximity_false_negatives = compare_pairs(contacts.near, near, {}).false_negatives;
    }
    depth_.follow(seen);
    row.depth_error = worst_error(contacts.contacts);
    row.native_depth_error = worst_error(contacts.native);
}

void Judge::judge_overlap(const Frame& after, StepRow& row) {
    bool any = false;
    Overlap worst;
    for (std::size_t pair = 0; pair < topology_->body_pairs.size(); ++pair) {
        const auto [a, b] = topology_->body_pairs[pair];
        const bool closed = topology_->bodies[static_cast<std::size_t>(a)].closed &&
                            topology_->bodies[static_cast<std::size_t>(b)].closed;
        if (!closed || yielding_[pair] == 0) continue;
        any = true;
        const Overlap overlap = overlap_.measure(*topology_, after.position, a, b);
        worst.volume += overlap.volume;
        worst.min_translation = std::fmax(worst.min_translation, overlap.min_translation);
    }
    if (!any) return;
    row.overlap_volume = worst.volume;
    row.min_translation = worst.min_translation;
}

void Judge::judge_outcome(const Frame& after, StepRow& row, double scripted_path, bool in_detail) {
    const DepthTruth::Result left = depth_.measure(after);
    if (materials_ != nullptr && !materials_->springs.empty()) {
        row.strain_over = 0.0;
        for (const Spring& spring : materials_->springs) {
            const double length = (after.position.col(spring.j) - after.position.col(spring.i)).norm();
            row.strain_over = std::max(row.strain_over, length / spring.rest - 1.0 - materials_->strain_limit);
        }
    }
    if (!anything_yields_) return;
    add_depth(left, row);
    if (in_detail) judge_overlap(after, row);
    if (left.wrong_side != 0 || left.side_undecided != 0 || row.pairs > 0) {
        if (left.wrong_side > 0) {
            last_depth_tick_ = row.tick;
            last_depth_path_ = scripted_path;
        }
    } else if (last_depth_tick_ >= 0 && row.tick <= last_depth_tick_ + overshoot_window) {
        row.overshoot = std::max(0.0, depth_.clearance() - (scripted_path - last_depth_path_));
    }
}

}  // namespace trocar
