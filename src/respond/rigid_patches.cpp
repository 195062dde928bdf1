#include "respond/rigid_patches.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>

namespace trocar {
void RigidPatches::prepare(const Topology& topology, const ContactLaws& laws) {
    topology_ = &topology;
    laws_ = &laws;
    surface_.prepare(topology);
    crossed_.reserve(256);
}

void RigidPatches::respond(const Frame& frame, double dt, std::span<const Contact> contacts, ResponseOutput& output) {
    surface_.measure(*topology_, frame.position);
    crossed_.clear();
    for (const Contact& contact : contacts) {
        if (topology_->bodies[at(contact.body_b)].kind == BodyKind::tissue) continue;
        const double rate =
            (contact.on_b.blend(frame.velocity) - contact.on_a.blend(frame.velocity)).dot(contact.normal);
        const double depth = -(contact.gap + rate * dt);
        if (!(depth > 0.0)) {
            output.skip(SkipReason::not_handled);  // open to the end of the tick
            continue;
        }
        crossed_.push_back({.contact = &contact,
                            .depth = depth,
                            .area = std::max(area_of(contact.on_a), area_of(contact.on_b)),
                            .foremost = is_foremost(frame, contact)});
    }
    std::sort(crossed_.begin(), crossed_.end(), [](const Crossed& a, const Crossed& b) {
        return std::tuple{a.contact->body_a, a.contact->body_b, a.contact->id} <
               std::tuple{b.contact->body_a, b.contact->body_b, b.contact->id};
    });
    for (auto first = crossed_.begin(); first != crossed_.end();) {
        const auto end = std::find_if(first, crossed_.end(), [&](const Crossed& one) {
            return one.contact->body_a != first->contact->body_a || one.contact->body_b != first->contact->body_b;
        });
        // On rough surfaces no feature may be foremost; then all count as foremost.
        if (std::none_of(first, end, [](const Crossed& one) { return one.foremost; })) {
            std::for_each(first, end, [](Crossed& one) { one.foremost = true; });
        }
        press(frame, {first, end}, output);
        first = end;
    }
}

/// True if neither body's surface extends beyond the vertex or edge, towards the other body. A point inside a face
/// qualifies.
bool RigidPatches::is_foremost(const Frame& frame, const Contact& contact) const {
    return is_outermost(frame, contact.on_a, contact.normal) && is_outermost(frame, contact.on_b, -contact.normal);
}

bool RigidPatches::is_outermost(const Frame& frame, const ContactPoint& point, const Vector3& direction) const {
    if (std::none_of(point.vertices.begin(), point.vertices.end(), [](Index v) { return v < 0; })) return true;
    constexpr double rounding = 1e-9;
    for (const Index v : point.vertices) {
        if (v < 0) continue;
        for (const Index t : surface_.triangles_at(v)) {
            for (int i = 0; i < 3; ++i) {
                const Vector3 path = frame.position.col(topology_->triangles(i, t)) - frame.position.col(v);
                if (path.dot(direction) > rounding * path.norm()) return false;
            }
        }
    }
    return true;
}

double RigidPatches::area_of(const ContactPoint& point) const {
    double sum = 0.0;
    for (std::size_t i = 0; i < 3; ++i) {
        if (point.vertices[i] >= 0) sum += point.weights[i] * surface_.area(point.vertices[i]);
    }
    return sum;
}

/// Appends the contacts of one patch, the crossed features of two bodies.
void RigidPatches::press(const Frame& frame, std::span<const Crossed> patch, ResponseOutput& output) const {
    const Index body_a = patch.front().contact->body_a;
    const Index body_b = patch.front().contact->body_b;
    const Crossed* deepest = nullptr;
    Vector3 normal = Vector3::Zero();
    double sum = 0.0;
    for (const Crossed& one : patch) {
        if (!one.foremost) continue;
        if (deepest == nullptr || one.depth > deepest->depth) deepest = &one;
        normal += one.share() * one.contact->normal;
        sum += one.share();
    }
    const double size = normal.norm();
    if (!(size > 0.0)) return;  // opposite normals cancel
    normal /= size;
    const auto carries = [&normal](const Crossed& one) {
        return one.share() * std::max(0.0, one.contact->normal.dot(normal));
    };
    double carried = 0.0;
    for (const Crossed& one : patch) carried += carries(one);
    const auto kind = [this](Index body) { return topology_->bodies[at(body)].kind; };
    const bool push_b = kind(body_b) == BodyKind::instrument;
    const double given = laws_->k(body_a, body_b);
    // Opposing features reduce k; the spread of normals of one rounded side does not.
    constexpr double one_side = 0.5;
    const double of_pair = std::isnan(given) ? rigid_stiffness : given;
    const double k = of_pair * std::min(1.0, size / (one_side * sum));
    for (const Crossed& one : patch) {
        const double share = carries(one) / carried;
        if (!(share > 0.0)) continue;
        const ContactPoint& pushed = push_b ? one.contact->on_b : one.contact->on_a;
        const ContactPoint& other = push_b ? one.contact->on_a : one.contact->on_b;
        ContactForceLaw linear;
        linear.k = k * share;
        linear.mu = laws_->mu(body_a, body_b, of_pair) * share;
        linear.source_id = one.contact->id;
        linear.gap = deepest->contact->gap;
        linear.normal = push_b ? normal : Vector3(-normal);
        linear.vertices = pushed.vertices;
        linear.weights = pushed.weights;
        linear.face_velocity = other.blend(frame.velocity).dot(linear.normal);
        if (push_b && kind(body_a) == BodyKind::instrument) {
            react_on_line(frame, body_a, linear);
        }
        output.contacts.push_back(linear);
    }
}

}  // namespace trocar
