#include "simulate/rupture.hpp"

#include <algorithm>

namespace trocar {
namespace {

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

Index heaviest(const LinearContact& contact) {
    const auto most = std::max_element(contact.weights.begin(), contact.weights.end()) - contact.weights.begin();
    return contact.vertices[static_cast<std::size_t>(most)];
}

}  // namespace

void Rupture::prepare(const Topology& topology) {
    strained_.assign(at(topology.vertex_count), {});
    touched_.clear();
    touched_.reserve(1024);
    touched_now_.clear();
    touched_now_.reserve(1024);
    tick_ = 0;
}

std::int64_t Rupture::judge(const Effect& effect, std::span<const ContactLoad> loads, double dt) {
    ++tick_;
    touched_now_.clear();
    for (std::size_t c = 0; c < std::min(effect.contacts.size(), loads.size()); ++c) {
        const LinearContact& contact = effect.contacts[c];
        if (contact.role != ContactRole::constraint || loads[c].normal == 0.0) continue;
        const Index vertex = heaviest(contact);
        if (vertex < 0) continue;
        Strained& one = strained_[at(vertex)];
        if (one.tick != tick_) {
            one.tick = tick_;
            one.at_limit = false;
            touched_now_.push_back(vertex);
        }
        one.at_limit = one.at_limit || loads[c].at_limit;
    }
    std::int64_t torn = 0;
    for (const Index vertex : touched_now_) {
        Strained& one = strained_[at(vertex)];
        one.time = one.at_limit ? one.time + dt : 0.0;
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
