#include "respond/velocity_changes.hpp"

#include <algorithm>
#include <cmath>

namespace trocar {
namespace {

std::size_t at_index(Index i) { return static_cast<std::size_t>(i); }

}  // namespace

void VelocityChanges::prepare(const ThesisState& state) {
    const std::size_t vertices = at_index(state.topology->vertex_count);
    tick_ = 0;
    notes_ = 0;
    pushed_.assign(vertices, 0.0);
    change_.assign(vertices, 0.0);
    asked_at_.assign(vertices, 0);
    held_at_.assign(vertices, 0);
    with_push_.clear();
    with_push_.reserve(vertices);
    fastest_.assign(state.topology->bodies.size(), {});
}

void VelocityChanges::begin_tick(const ThesisState& state, const Frame& frame) {
    state_ = &state;
    frame_ = &frame;
    ++tick_;
}

void VelocityChanges::note(const Effect& effect) {
    ++notes_;
    for (const Index v : with_push_) pushed_[at_index(v)] = 0.0;
    with_push_.clear();
    largest_push_ = 0.0;
    for (const LinearContact& contact : effect.contacts) {
        if (contact.vertices[0] < 0 || contact.reaction_vertices[0] >= 0 || contact.bilateral()) continue;
        const Index body = state_->topology->body_of_vertex(contact.vertices[0]);
        if (state_->kind(body) != BodyKind::tissue) continue;
        double speed = 0.0;
        for (std::size_t i = 0; i < 3; ++i) {
            if (contact.vertices[i] < 0) continue;
            speed += contact.weights[i] * frame_->velocity.col(contact.vertices[i]).dot(contact.normal);
        }
        const double change =
            contact.face_velocity - speed + std::max(-contact.gap, 0.0) / state_->settings.settle_time;
        largest_push_ = std::max(largest_push_, change);
        const bool holds = contact.gap <= state_->touching_gap(body);
        for (const Index v : contact.vertices) {
            if (v < 0) continue;
            double& pushed = pushed_[at_index(v)];
            if (pushed == 0.0 && change > 0.0) with_push_.push_back(v);
            pushed = std::max(pushed, change);
            if (holds) held_at_[at_index(v)] = notes_;
        }
    }
}

double VelocityChanges::at(Index vertex) {
    double& change = change_[at_index(vertex)];
    if (asked_at_[at_index(vertex)] == notes_) return change;
    asked_at_[at_index(vertex)] = notes_;
    const Topology& topology = *state_->topology;
    double square = 0.0;
    double pushed = 0.0;
    for (const Index t : state_->surface.triangles_at(vertex)) {
        for (int i = 0; i < 3; ++i) {
            const Index corner = topology.triangles(i, t);
            const Index next = topology.triangles((i + 1) % 3, t);
            square = std::max(square, (frame_->velocity.col(corner) - frame_->velocity.col(next)).squaredNorm());
            pushed = std::max(pushed, pushed_[at_index(corner)]);
        }
    }
    change = std::max(std::sqrt(square), pushed);
    return change;
}

double VelocityChanges::when_free(Index vertex) {
    const auto v = at_index(vertex);
    double freed = 0.0;
    if (!state_->fixed(vertex) && held_at_[v] != notes_) {
        const TissueEdit here{
            .vertex = vertex, .position = frame_->position.col(vertex), .velocity = frame_->velocity.col(vertex)};
        freed = state_->internal_force_on(*frame_, here).norm() / state_->materials->mass[v] * state_->dt;
    }
    return at(vertex) + freed;
}

double VelocityChanges::fastest(Index body) {
    const BodyRange& range = state_->topology->bodies[at_index(body)];
    Fastest& known = fastest_[at_index(body)];
    if (known.asked_at != tick_) {
        double square = 0.0;
        for (Index v = range.vertices.first; v < range.vertices.end(); ++v) {
            square = std::max(square, frame_->velocity.col(v).squaredNorm());
        }
        known = {tick_, std::sqrt(square)};
    }
    const double speed = known.speed;
    return range.kind == BodyKind::tissue ? speed + std::max(2.0 * speed, largest_push_) : speed;
}

}  // namespace trocar
