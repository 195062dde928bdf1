// Hash set of keys with clear() in constant time, which keeps the memory.
#pragma once

#include <bit>
#include <cstdint>
#include <vector>

#include "geometry/random.hpp"

namespace trocar {

class KeySet {
public:
    void clear() {
        count_ = 0;
        if (++stamp_ == 0) {
            slots_.assign(slots_.size(), {});
            stamp_ = 1;
        }
    }
    /// False if the key was present.
    bool insert(std::uint64_t key) {
        if (2 * (count_ + 1) > slots_.size()) grow();
        for (std::size_t s = fibonacci_slot(key, bits_);; s = (s + 1) & (slots_.size() - 1)) {
            if (slots_[s].stamp != stamp_) {
                slots_[s] = {key, stamp_};
                ++count_;
                return true;
            }
            if (slots_[s].key == key) return false;
        }
    }

private:
    struct Slot {
        std::uint64_t key = 0;
        std::uint32_t stamp = 0;
    };
    void grow() {
        std::vector<Slot> old;
        old.swap(slots_);
        slots_.assign(old.empty() ? 1024 : 2 * old.size(), {});
        bits_ = std::countr_zero(slots_.size());
        count_ = 0;
        for (const Slot& slot : old) {
            if (slot.stamp == stamp_) insert(slot.key);
        }
    }
    std::vector<Slot> slots_;
    std::size_t count_ = 0;
    std::uint32_t stamp_ = 1;
    int bits_ = 0;  ///< slots_ has 2^bits_ entries
};

}  // namespace trocar
