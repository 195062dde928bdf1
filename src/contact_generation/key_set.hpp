// Hash set of keys with clear() in constant time, which keeps the memory.
#pragma once

#include <cstdint>
#include <vector>

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
        for (std::size_t s = place(key);; s = (s + 1) & (slots_.size() - 1)) {
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
    [[nodiscard]] std::size_t place(std::uint64_t key) const {
        return static_cast<std::size_t>((key * 0x9E3779B97F4A7C15ULL) >> shift_);
    }
    void grow() {
        std::vector<Slot> old;
        old.swap(slots_);
        slots_.assign(old.empty() ? 1024 : 2 * old.size(), {});
        shift_ = 64;
        for (std::size_t size = slots_.size(); size > 1; size /= 2) --shift_;
        count_ = 0;
        for (const Slot& slot : old) {
            if (slot.stamp == stamp_) insert(slot.key);
        }
    }
    std::vector<Slot> slots_;
    std::size_t count_ = 0;
    std::uint32_t stamp_ = 1;
    int shift_ = 64;
};

}  // namespace trocar
