#include "contact/response_output.hpp"

#include <algorithm>

namespace trocar {

void ResponseOutput::resize(Index vertex_count, Index body_count) {
    held_force.setZero(3, vertex_count);
    wrench.assign(static_cast<std::size_t>(body_count), Wrench{});
}

void ResponseOutput::clear() {
    contacts.clear();
    position_corrections.clear();
    held_force.setZero();
    std::fill(wrench.begin(), wrench.end(), Wrench{});
    skipped.fill(0);
    no_hit = 0;
    detached = 0;
    grasped = 0;
    contact_timing = ContactTiming::implicit;
    solver = nullptr;
    solver_timing = SolverTiming::substep;
}

}  // namespace trocar
