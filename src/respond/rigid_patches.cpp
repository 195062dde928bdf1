#include "respond/rigid_patches.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "respond/surface.hpp"

namespace trocar {
namespace {

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

}  // namespace

void RigidPatches::prepare(const Topology& topology, const Materials& materials, double k, double mu) {
    topology_ = &topology;
    laws_.prepare(topology, materials, k, mu);
    area_.assign(at(topology.vertex_count), 0.0);
    measured_ = false;
    crossed_.reserve(256);
}

void RigidPatches::respond(const Frame& frame, std::span<const Contact> contacts, Effect& effect) {
    if (!measured_) {
        for (Index t = 0; t < topology_->triangle_count(); ++t) {
            const double third = area_normal(*topology_, frame.position, t).norm() / 6.0;
            for (int i = 0; i < 3; ++i) area_[at(topology_->triangles(i, t))] += third;
        }
        measured_ = true;
    }
    crossed_.clear();
    for (const Contact& contact : contacts) {
        const bool tissue = topology_->bodies[at(contact.body_b)].kind == BodyKind::tissue;
        const double depth = -(contact.gap + contact.approach);
        if (tissue || !(depth > 0.0)) continue;
        crossed_.push_back({&contact, depth, std::max(area_of(contact.on_a), area_of(contact.on_b))});
    }
    std::sort(crossed_.begin(), crossed_.end(), [](const Crossed& a, const Crossed& b) {
        return std::tuple{a.contact->body_a, a.contact->body_b, a.contact->id} <
               std::tuple{b.contact->body_a, b.contact->body_b, b.contact->id};
    });
    for (auto first = crossed_.begin(); first != crossed_.end();) {
        const Index body_a = first->contact->body_a;
        const Index body_b = first->contact->body_b;
        double deepest = 0.0;
        double sum = 0.0;
        double damped = 0.0;
        auto end = first;
        for (; end != crossed_.end() && end->contact->body_a == body_a && end->contact->body_b == body_b; ++end) {
            deepest = std::max(deepest, end->depth);
            sum += end->depth * end->depth * end->area;
            damped += end->depth * end->area;
        }
        const double given = laws_.k(body_a, body_b);
        const double k = std::isnan(given) ? rigid_stiffness : given;
        const double mu = laws_.mu(body_a, body_b);
        for (; first != end; ++first) {
            const double share = deepest * first->depth * first->area / sum;
            press(frame, k * share, mu * first->depth * first->area / damped, *first, effect);
        }
    }
}

double RigidPatches::area_of(const ContactPoint& point) const {
    double sum = 0.0;
    for (std::size_t i = 0; i < 3; ++i) {
        if (point.vertices[i] >= 0) sum += point.weights[i] * area_[at(point.vertices[i])];
    }
    return sum;
}

void RigidPatches::press(const Frame& frame, double k, double mu, const Crossed& one, Effect& effect) const {
    const Contact& contact = *one.contact;
    const auto kind = [this](Index body) { return topology_->bodies[at(body)].kind; };
    const bool push_b = kind(contact.body_b) == BodyKind::instrument;
    LinearContact linear;
    linear.k = k;
    linear.mu = mu;
    linear.source_id = contact.id;
    linear.gap = contact.gap;
    linear.normal = push_b ? contact.normal : Vector3(-contact.normal);
    const ContactPoint& pushed = push_b ? contact.on_b : contact.on_a;
    const ContactPoint& other = push_b ? contact.on_a : contact.on_b;
    linear.vertices = pushed.vertices;
    linear.weights = pushed.weights;
    linear.face_velocity = other.blend(frame.velocity).dot(linear.normal);
    if (push_b && kind(contact.body_a) == BodyKind::instrument) {
        linear.reaction_body = contact.body_a;
        linear.reaction_point = other.blend(frame.position);
    }
    effect.contacts.push_back(linear);
}

}  // namespace trocar
