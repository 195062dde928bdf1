#include "respond/grasp.hpp"

#include <algorithm>
#include <cmath>

#include "respond/tissue_scale.hpp"
#include "scene/mesh_bodies.hpp"

namespace trocar {
namespace {

constexpr double close_below = 0.2;
constexpr double open_above = 0.3;
constexpr std::size_t most_vertices = 8;
constexpr double radius_of_jaw = 2.5 / 12.0;  ///< of jaw_length: half the diagonal of 4 × 3 mm at 12 mm (METHODS §10)

}  // namespace

void Grasp::prepare(const Topology& topology, const Materials& materials, const GraspSettings& settings) {
    settings_ = settings;
    constexpr double touching = 0.02;  // mean edges of the tissue
    touching_.clear();
    for (const TissueScale& scale : tissue_scales(topology, materials)) touching_.push_back(touching * scale.edge);
    groups_.clear();
    group_of_body_.assign(at(topology.body_count()), -1);
    for (Index b = 0; b < topology.body_count(); ++b) {
        const BodyRange& body = topology.bodies[at(b)];
        if (body.kind != BodyKind::instrument) continue;
        const auto found = std::find_if(groups_.begin(), groups_.end(), [&](const Group& group) {
            return !body.instrument.empty() && group.name == body.instrument;
        });
        group_of_body_[at(b)] = static_cast<Index>(found - groups_.begin());
        if (found == groups_.end()) groups_.push_back({.body = b, .name = body.instrument});
    }
    const std::vector<Index> component = component_of_triangle(topology.triangles, topology.vertex_count);
    piece_.assign(at(topology.vertex_count), -1);
    for (Index t = 0; t < topology.triangle_count(); ++t) {
        for (int i = 0; i < 3; ++i) piece_[at(topology.triangles(i, t))] = component[at(t)];
    }
    holder_.assign(at(topology.vertex_count), -1);
    held_.clear();
    held_.reserve(groups_.size() * most_vertices);
    parting_.clear();
    parting_.reserve(groups_.size() * most_vertices);
}

void Grasp::detach(std::size_t position) {
    if (settings_.release_time > 0.0) parting_.push_back({.held = held_[position], .stiffness = settings_.stiffness});
    holder_[at(held_[position].vertex)] = -1;
    held_.erase(held_.begin() + static_cast<std::ptrdiff_t>(position));
}

void Grasp::update(const Topology& topology, const Materials& materials, const Frame& frame,
                   const ContactSet& contacts) {
    if (frame.pose.size() != group_of_body_.size()) return;
    for (Index g = 0; g < static_cast<Index>(groups_.size()); ++g) {
        Group& group = groups_[at(g)];
        const double jaw = frame.pose[at(group.body)].jaw;
        if (jaw > open_above) {
            for (std::size_t i = held_.size(); i-- > 0;) {
                if (held_[i].group == g) detach(i);
            }
        }
        if (group.seen && group.last_jaw > close_below && jaw <= close_below) {
            attach(topology, materials, frame, contacts, g);
        }
    }
}

void Grasp::attach(const Topology& topology, const Materials& materials, const Frame& frame, const ContactSet& contacts,
                   Index group) {
    const Index body = groups_[at(group)].body;
    const Pose& pose = frame.pose[at(body)];
    const Vector3 tip = pose.rotation * materials.tip[at(body)] + pose.translation;
    // The jaw axis runs from the tip to the mean of the instrument's vertices.
    Vector3 middle = Vector3::Zero();
    double vertices = 0.0;
    for (Index b = 0; b < topology.body_count(); ++b) {
        if (group_of_body_[at(b)] != group) continue;
        const Range range = topology.bodies[at(b)].vertices;
        for (Index v = range.first; v < range.end(); ++v) middle += frame.position.col(v);
        vertices += range.count;
    }
    middle /= std::max(vertices, 1.0);
    const Vector3 axis = (middle - tip).norm() > 0.0 ? Vector3((middle - tip).normalized()) : Vector3::UnitZ();

    touches_.clear();
    const auto touch = [&](Index v, Index instrument_vertex, const Vector3& normal) {
        if (holder_[at(v)] >= 0 || materials.pinned[at(v)] != 0) return;
        const Vector3 from_tip = frame.position.col(v) - tip;
        const double along = from_tip.dot(axis);
        const double radius = radius_of_jaw * settings_.jaw_length;
        if (along < -radius || along > settings_.jaw_length || (from_tip - along * axis).norm() > radius) return;
        touches_.push_back(
            {.vertex = v, .normal = normal, .piece = piece_[at(instrument_vertex)], .distance = from_tip.norm()});
    };
    for (const Contact& contact : contacts.contacts) {
        if (contact.body_a < 0 || contact.body_b < 0 || contact.kind == ContactCase::touch) continue;
        if (group_of_body_[at(contact.body_a)] != group) continue;
        if (topology.bodies[at(contact.body_b)].kind != BodyKind::tissue) continue;
        if (contact.kind == ContactCase::point_face || contact.kind == ContactCase::edge_edge) {
            if (!(contact.gap < touching_[at(contact.body_b)])) continue;
            const Index on_jaw = *std::find_if(contact.on_a.vertices.begin(), contact.on_a.vertices.end(),
                                               [](Index v) { return v >= 0; });
            for (const Index v : contact.on_b.vertices) {
                if (v >= 0) touch(v, on_jaw, contact.normal);
            }
        } else if (contact.a >= 0 && contact.b >= 0) {
            for (int i = 0; i < 3; ++i) {
                touch(topology.triangles(i, contact.b), topology.triangles(0, contact.a), contact.normal);
            }
        }
    }
    const bool pinched = std::any_of(touches_.begin(), touches_.end(), [this](const Touch& one) {
        return one.piece != touches_.front().piece || one.normal.dot(touches_.front().normal) < 0.0;
    });
    if (settings_.both_jaws && !pinched) return;
    std::sort(touches_.begin(), touches_.end(), [](const Touch& a, const Touch& b) {
        return a.distance != b.distance ? a.distance < b.distance : a.vertex < b.vertex;
    });
    std::size_t taken = 0;
    for (const Touch& one : touches_) {
        if (taken == most_vertices) break;
        if (holder_[at(one.vertex)] >= 0) continue;  // held already: a vertex may have several contacts
        const Vector3 local = pose.rotation.conjugate() * (frame.position.col(one.vertex) - pose.translation);
        held_.push_back({.vertex = one.vertex, .group = group, .local = local});
        holder_[at(one.vertex)] = group;
        std::erase_if(parting_, [&one](const PartingVertex& parting) { return parting.held.vertex == one.vertex; });
        ++taken;
    }
}

Vector3 Grasp::target(const Frame& frame, const GraspedVertex& held) const {
    const Pose& pose = frame.pose[at(groups_[at(held.group)].body)];
    return pose.rotation * held.local + pose.translation;
}

Vector3 Grasp::target_velocity(const Frame& frame, const GraspedVertex& held, double dt) const {
    const Group& group = groups_[at(held.group)];
    if (!group.seen) return Vector3::Zero();
    const Vector3 before = group.last_pose.rotation * held.local + group.last_pose.translation;
    return (target(frame, held) - before) / dt;
}

void Grasp::hold_by_springs(const Materials& materials, const VertexSprings& springs, const Frame& frame, double dt,
                            ResponseOutput& output) {
    for (std::size_t i = held_.size(); i-- > 0;) {
        const double pull =
            settings_.stiffness * (target(frame, held_[i]) - frame.position.col(held_[i].vertex)).norm();
        constexpr double at_limit = 0.999;  // the limiter leaves edges below the limit by rounding
        const bool torn =
            springs.largest_strain(materials, frame.position, held_[i].vertex) >= at_limit * materials.strain_limit;
        if (pull <= settings_.slip_force && !torn) continue;
        detach(i);
        ++output.detached;
    }
    for (const GraspedVertex& held : held_) pull(materials, frame, held, settings_.stiffness, dt, output);
    weaken(frame, dt);
    for (const PartingVertex& parting : parting_) {
        pull(materials, frame, parting.held, parting.stiffness, dt, output);
    }
}

void Grasp::pull(const Materials& materials, const Frame& frame, const GraspedVertex& held, double stiffness, double dt,
                 ResponseOutput& output) const {
    const Vector3 place = target(frame, held);
    const Vector3 offset = place - frame.position.col(held.vertex);
    const Vector3 speed = target_velocity(frame, held, dt);
    // The target includes this tick's scripted motion; the gap refers to the start of the tick.
    const Vector3 scripted = (speed - frame.operator_velocity(body_of(held.group), dt)) * dt;
    for (int axis = 0; axis < 3; ++axis) {
        ContactForceLaw linear;
        linear.vertices = {held.vertex, -1, -1};
        linear.weights = {1.0, 0.0, 0.0};
        linear.normal = Vector3::Unit(axis);
        linear.gap = scripted[axis] - offset[axis];
        linear.k = stiffness;
        linear.mu = 2.0 * std::sqrt(stiffness * materials.mass[at(held.vertex)]);
        linear.face_velocity = speed[axis];
        linear.role = ContactRole::grasp;
        linear.reaction_body = body_of(held.group);
        linear.reaction_point = place;
        output.contacts.push_back(linear);
    }
}

/// The force on a released vertex falls evenly to zero. The stiffness never rises, so that the spring returns no stored
/// energy to the tissue.
void Grasp::weaken(const Frame& frame, double dt) {
    for (PartingVertex& parting : parting_) {
        const double stretch = (target(frame, parting.held) - frame.position.col(parting.held.vertex)).norm();
        if (parting.age == 0.0) parting.first_force = parting.stiffness * stretch;
        parting.age += dt;
        const double left = std::max(0.0, 1.0 - parting.age / settings_.release_time);
        parting.stiffness = std::min(parting.stiffness, left * settings_.stiffness);
        if (stretch > 0.0) parting.stiffness = std::min(parting.stiffness, left * parting.first_force / stretch);
    }
    std::erase_if(parting_, [](const PartingVertex& parting) { return parting.stiffness <= 0.0; });
}

void Grasp::remember(const Frame& frame) {
    if (frame.pose.size() != group_of_body_.size()) return;
    for (Group& group : groups_) {
        group.last_pose = frame.pose[at(group.body)];
        group.last_jaw = group.last_pose.jaw;
        group.seen = true;
    }
}

}  // namespace trocar
