#include "simulate/rupture.hpp"

#include <algorithm>

#include "contact/contact.hpp"

namespace trocar {
void Rupture::prepare(const Topology& topology, const Materials& materials) {
    topology_ = &topology;
    materials_ = &materials;
    springs_.prepare(topology, materials);
    strained_.assign(at(topology.vertex_count), {});
    touched_.clear();
    touched_.reserve(1024);
    touched_now_.clear();
    touched_now_.reserve(1024);
    tick_ = 0;
}

bool Rupture::is_at_strain_limit(const Frame& frame, Index vertex) const {
    constexpr double at_limit = 0.999;  // the limiter leaves an edge below its limit by rounding
    return springs_.largest_strain(*materials_, frame.position, vertex) >= at_limit * materials_->strain_limit;
}

std::int64_t Rupture::judge(const Frame& frame, const ResponseOutput& output,
                            std::span<const ContactForce> contact_forces, double dt) {
    ++tick_;
    touched_now_.clear();
    for (std::size_t c = 0; c < std::min(output.contacts.size(), contact_forces.size()); ++c) {
        const ContactForceLaw& contact = output.contacts[c];
        if (contact.bilateral() || !(contact_forces[c].normal > 0.0)) continue;
        const Index vertex = ContactPoint{contact.vertices, contact.weights}.heaviest();
        if (vertex < 0 || topology_->bodies[at(topology_->body_of_vertex(vertex))].kind != BodyKind::tissue) continue;
        Strained& one = strained_[at(vertex)];
        if (one.tick != tick_) {
            one.tick = tick_;
            one.yields = false;
            touched_now_.push_back(vertex);
        }
        one.yields =
            one.yields || contact_forces[c].at_limit || (contact.gap < -deep && is_at_strain_limit(frame, vertex));
    }
    std::int64_t torn = 0;
    for (const Index vertex : touched_now_) {
        Strained& one = strained_[at(vertex)];
        one.time = one.yields ? one.time + dt : 0.0;
        if (one.time <= tear_time || one.torn) continue;
        one.torn = true;
        ++torn;
    }
    for (const Index vertex : touched_) {
        if (strained_[at(vertex)].tick != tick_) strained_[at(vertex)] = {};
    }
    touched_.swap(touched_now_);
    return torn;
}

}  // namespace trocar
