// Partners of each triangle in the detector's pairs, without a scan of all pairs.
#pragma once

#include <vector>

#include "contact/contact_set.hpp"

namespace trocar {

class Partners {
public:
    void prepare(Index triangle_count) {
        first_.assign(static_cast<std::size_t>(triangle_count), none);
        entries_.clear();
        entries_.reserve(2048);
    }

    /// Replaces the partners by those of this tick's `pairs` and `near`.
    void gather(const ContactSet& contacts) {
        for (const Entry& entry : entries_) first_[static_cast<std::size_t>(entry.triangle)] = none;
        entries_.clear();
        for (const std::vector<TrianglePair>* pairs : {&contacts.pairs, &contacts.near}) {
            for (const TrianglePair& pair : *pairs) {
                add(pair.a, pair.b);
                add(pair.b, pair.a);
            }
        }
    }

    /// Calls act(other) for every partner of the triangle, in unspecified order.
    template <typename Act>
    void visit(Index triangle, const Act& act) const {
        for (Index i = first_[static_cast<std::size_t>(triangle)]; i != none;) {
            const Entry& entry = entries_[static_cast<std::size_t>(i)];
            act(entry.other);
            i = entry.next;
        }
    }

private:
    static constexpr Index none = -1;
    struct Entry {
        Index triangle = none;
        Index other = none;
        Index next = none;
    };
    void add(Index triangle, Index other) {
        Index& first = first_[static_cast<std::size_t>(triangle)];
        entries_.push_back({triangle, other, first});
        first = static_cast<Index>(entries_.size()) - 1;
    }

    std::vector<Index> first_;  ///< per triangle
    std::vector<Entry> entries_;
};

}  // namespace trocar
