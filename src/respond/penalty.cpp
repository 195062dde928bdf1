// The plain penalty response that most simulators use: spring and damper along the contact normal, pressing only. It
// reads canonical contacts as well as a library's own, so that the contact source can be a factor of a study.
#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "method/entry.hpp"
#include "respond/common.hpp"
#include "respond/equations.hpp"

namespace trocar {
namespace {

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

struct Settings {
    bool reduce = true;  ///< one contact per vertex and other body, the deepest
    bool fulcrum = false;
    double k = 0.0;   ///< NaN: auto
    double mu = 0.0;  ///< NaN: auto
};

class Penalty final : public Response {
public:
    explicit Penalty(const Settings& settings) : settings_(settings) {}

    void prepare(const Topology& topology, const Materials& materials) override {
        topology_ = &topology;
        materials_ = &materials;
        laws_.prepare(topology, materials, settings_.k, settings_.mu);
        first_.assign(at(topology.vertex_count), -1);
        candidates_.clear();
        moment_.assign(at(topology.body_count()), {});
    }

    void respond(const Frame& frame, double /*dt*/, const ContactSet& contacts, Effect& effect) override {
        effect.clear();
        for (const Candidate& candidate : candidates_) first_[at(candidate.vertex)] = -1;
        candidates_.clear();
        for (const Contact& contact : contacts.contacts) {
            Candidate candidate;
            if (!describe(frame, contact, candidate)) {
                ++effect.skipped;
            } else if (!settings_.reduce) {
                candidates_.push_back(candidate);
            } else {
                keep_deepest(candidate);
            }
        }
        for (const Candidate& candidate : candidates_) add(frame, candidate, effect);
        show_tip_forces(*topology_, *materials_, frame, settings_.fulcrum, moment_, effect);
    }

private:
    struct Candidate {
        Index vertex = -1;  ///< the vertex that stands for the contact in a reduction
        Index other = -1;   ///< body on the other side of that vertex
        Index next = -1;    ///< next candidate of the same vertex
        Index body_a = -1;
        Index body_b = -1;
        LoadPoint a, b;
        Vector3 point_a = Vector3::Zero();
        Vector3 normal = Vector3::Zero();  ///< unit, a to b
        double depth = 0.0;                ///< m
    };

    /// False for what has no response: touch, coplanar, degenerate, classes that need no force, and native contacts
    /// that lack triangles, normal or depth.
    bool describe(const Frame& frame, const Contact& contact, Candidate& candidate) const {
        if (contact.kind == ContactCase::touch || contact.kind == ContactCase::coplanar ||
            contact.kind == ContactCase::degenerate || contact.a < 0 || contact.b < 0) {
            return false;
        }
        candidate.body_a = topology_->body_of_triangle[at(contact.a)];
        candidate.body_b = topology_->body_of_triangle[at(contact.b)];
        const CollisionClass kind = laws_.kind(candidate.body_a, candidate.body_b);
        if (kind == CollisionClass::none || kind == CollisionClass::rigid_tissue ||
            kind == CollisionClass::tissue_tissue) {
            return false;
        }
        candidate.normal = contact.normal;
        candidate.depth = contact.depth;
        if (!candidate.normal.allFinite() || !std::isfinite(candidate.depth) || candidate.depth < 0.0) return false;

        const bool vertex_of_a = contact.kind == ContactCase::a_enters_b && contact.vertex_a >= 0;
        const bool vertex_of_b = contact.kind == ContactCase::b_enters_a && contact.vertex_b >= 0;
        Vector3 point = contact.point;
        if (vertex_of_a) point = frame.position.col(contact.vertex_a);
        if (vertex_of_b) point = frame.position.col(contact.vertex_b);
        if (!point.allFinite()) return false;
        const auto spread = [&](Index triangle) {
            const equations::Corners corners = corners_of(*topology_, frame.position, triangle);
            return LoadPoint::in_triangle(*topology_, triangle, equations::nearest_weights(corners, point));
        };
        candidate.a = vertex_of_a ? LoadPoint::at_vertex(contact.vertex_a) : spread(contact.a);
        candidate.b = vertex_of_b ? LoadPoint::at_vertex(contact.vertex_b) : spread(contact.b);
        candidate.point_a = candidate.a.blend(frame.position);
        // Without an entering vertex the most loaded vertex of b stands for the contact.
        if (vertex_of_a) {
            candidate.vertex = contact.vertex_a;
            candidate.other = candidate.body_b;
        } else {
            const auto heaviest = std::max_element(candidate.b.weights.begin(), candidate.b.weights.end());
            candidate.vertex = candidate.b.vertices[static_cast<std::size_t>(heaviest - candidate.b.weights.begin())];
            candidate.other = candidate.body_a;
        }
        return true;
    }

    void keep_deepest(Candidate& candidate) {
        Index& first = first_[at(candidate.vertex)];
        for (Index c = first; c >= 0; c = candidates_[at(c)].next) {
            if (candidates_[at(c)].other != candidate.other) continue;
            if (candidate.depth > candidates_[at(c)].depth) {
                candidate.next = candidates_[at(c)].next;
                candidates_[at(c)] = candidate;
            }
            return;
        }
        candidate.next = first;
        first = static_cast<Index>(candidates_.size());
        candidates_.push_back(candidate);
    }

    /// F = max(0, k d - mu v_n) n on b, its opposite on a. Tissue is pushed where there is tissue; between an
    /// instrument and a rigid body only the instrument is.
    void add(const Frame& frame, const Candidate& candidate, Effect& effect) const {
        const CollisionClass kind = laws_.kind(candidate.body_a, candidate.body_b);
        const bool push_b = kind != CollisionClass::instrument_rigid;
        const LoadPoint& pushed = push_b ? candidate.b : candidate.a;
        const LoadPoint& other = push_b ? candidate.a : candidate.b;
        LinearContact linear;
        linear.vertices = pushed.vertices;
        linear.weights = pushed.weights;
        linear.normal = push_b ? candidate.normal : Vector3(-candidate.normal);
        linear.gap = -candidate.depth;
        linear.mu = laws_.mu(candidate.body_a, candidate.body_b);
        linear.k = laws_.k(candidate.body_a, candidate.body_b);
        if (std::isnan(linear.k)) {
            linear.k = rigid_stiffness;
            if (kind == CollisionClass::instrument_tissue) {
                linear.k = 0.0;
                for (std::size_t i = 0; i < 3; ++i) {
                    if (pushed.vertices[i] < 0) continue;
                    linear.k += pushed.weights[i] * materials_->mean_stiffness[at(pushed.vertices[i])];
                }
            }
        }
        linear.face_velocity = other.blend(frame.velocity).dot(linear.normal);
        if (push_b) {
            linear.reaction_body = candidate.body_a;
            linear.reaction_point = candidate.point_a;
        }
        effect.contacts.push_back(linear);
    }

    Settings settings_;
    const Topology* topology_ = nullptr;
    const Materials* materials_ = nullptr;
    PairLaws laws_;
    std::vector<Index> first_;  ///< N; first candidate of a vertex
    std::vector<Candidate> candidates_;
    std::vector<Wrench> moment_;
};

}  // namespace

ResponseEntry penalty_response() {
    ResponseEntry entry;
    entry.name = "penalty";
    entry.version = "1";
    entry.table_row = "B. Geiger et al";
    entry.own = true;
    entry.parameters = {
        stiffness_parameter("1000 between instruments and rigid bodies, on tissue the mean of the springs there"),
        damping_parameter(),
        {.name = "reduction",
         .type = Parameter::Type::choice,
         .default_value = "vertex",
         .choices = {"pair", "vertex"},
         .meaning = "one contact per triangle pair, or per vertex and other body (the deepest)"},
        tip_parameter("sum")};
    entry.make = [](const ParameterValues& values) -> std::unique_ptr<Response> {
        return std::make_unique<Penalty>(Settings{.reduce = values.is("reduction", "vertex"),
                                                  .fulcrum = values.is("tip", "fulcrum"),
                                                  .k = values.number("k"),
                                                  .mu = values.number("mu")});
    };
    return entry;
}

}  // namespace trocar
