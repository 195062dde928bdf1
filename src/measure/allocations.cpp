#include "measure/allocations.hpp"

namespace trocar {
namespace {
std::int64_t (*registered_counter)() = nullptr;
}

std::int64_t allocation_count() { return registered_counter == nullptr ? -1 : registered_counter(); }

void set_allocation_counter(std::int64_t (*counter)()) { registered_counter = counter; }

}  // namespace trocar
