// What the stages of ohc_clustered share: the detector's settings and the clock by which each knows what moved since
// the last answer. The book of a tick's work is that of ohc (ohc_work.hpp). Nothing is computed here.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "detect/clusters.hpp"
#include "detect/shared_parameters.hpp"

namespace trocar {

/// Regions, cells, candidates and pairs of an ordinary contact: room for as many is made before the first tick.
inline constexpr std::size_t ordinary_contact = 4096;

struct ClusteredSettings : SharedSettings {
    ClusterOrder order = ClusterOrder::automatic;
    bool scalar = false;
};

/// The version of a kernel that the settings ask for, of versions_by_target.
template <typename Kernels>
const Kernels& kernels_of(const ClusteredSettings& settings, const std::vector<Kernels>& versions) {
    return settings.scalar ? versions.back() : versions.front();
}

/// Times are counted in reads of a frame.
struct ClusteredClock {
    static constexpr std::int64_t never = -1;
    std::int64_t now = 0;              ///< the last read
    std::int64_t answered_at = never;  ///< the read that the last pairs answer completely
    bool path = false;                 ///< swept, and the last update's frame knows the frame before
    double query_distance = 0.0;       ///< m, within which the last update is to be answered
    /// Whether what moved last at this time did so after the last answer.
    [[nodiscard]] bool moved(std::int64_t moved_at) const { return moved_at > answered_at; }
};

}  // namespace trocar
