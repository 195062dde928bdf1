// Lists a kernel's versions: one per instruction set that this program was compiled for and this CPU has.
#pragma once

#include <hwy/targets.h>

#include <cstdint>
#include <vector>

namespace trocar {

/// Results of `version_of(name)`, called while HWY_DYNAMIC_DISPATCH selects the instruction set of that name. Best one
/// first, Highway's scalar target last.
template <typename VersionOf>
auto versions_by_target(const VersionOf& version_of) {
    std::vector<decltype(version_of(""))> versions;
    // Lower bits are better targets.
    for (std::int64_t rest = hwy::SupportedTargets() & HWY_TARGETS; rest != 0; rest &= rest - 1) {
        const std::int64_t target = rest & -rest;
        hwy::GetChosenTarget().Update(target);
        versions.push_back(version_of(hwy::TargetName(target)));
    }
    hwy::GetChosenTarget().Update(hwy::SupportedTargets());
    return versions;
}

}  // namespace trocar
