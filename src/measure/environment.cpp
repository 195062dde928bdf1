#include "measure/environment.hpp"

#include <fmt/format.h>
#include <sys/utsname.h>

#include <fstream>
#include <thread>

#include "build_facts.hpp"
#include "geometry/fnv_hash.hpp"
#include "measure/allocations.hpp"
#include "source_state.hpp"

namespace trocar {
namespace {

constexpr const char* unknown = "unknown";

std::string first_line(const char* file) {
    std::ifstream stream(file);
    std::string line;
    return std::getline(stream, line) && !line.empty() ? line : unknown;
}

/// Value of the first "key : value" line of /proc/cpuinfo with one of these keys.
std::string processor_name() {
    std::ifstream stream("/proc/cpuinfo");
    for (std::string line; std::getline(stream, line);) {
        if (!line.starts_with("model name") && !line.starts_with("Model")) continue;
        const auto colon = line.find(": ");
        if (colon != std::string::npos) return line.substr(colon + 2);
    }
    return unknown;
}

std::string kernel() {
    utsname name{};
    if (uname(&name) != 0) return unknown;
    return fmt::format("{} {} {}", name.sysname, name.release, name.machine);
}

/// Mean number of runnable processes over the last minute: shows a noisy machine.
std::string load() {
    const std::string line = first_line("/proc/loadavg");
    return line.substr(0, line.find(' '));
}

/// Hash over host name and machine-id, 16 hex digits: different machines differ, and none is named.
std::string machine() {
    FnvHash hash;
    utsname name{};
    if (uname(&name) == 0) hash.add_text(name.nodename);
    hash.add_text(first_line("/etc/machine-id"));
    return hash.text();
}

}  // namespace

std::map<std::string, std::string> environment() {
#ifdef NDEBUG
    const char* assertions = "off";
#else
    const char* assertions = "on";
#endif
    return {
        {"machine", machine()},
        {"cpu", processor_name()},
        {"cores", fmt::format("{}", std::thread::hardware_concurrency())},
        {"governor", first_line("/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor")},
        {"kernel", kernel()},
        {"load", load()},
        {"compiler", build_facts::compiler},
        {"flags", build_facts::flags},
        {"build_type", build_facts::build_type},
        {"assertions", assertions},
        {"sanitizers", *build_facts::sanitizers == '\0' ? "none" : build_facts::sanitizers},
        {"allocations_counted", allocation_count() < 0 ? "no" : "yes"},
        {"version", build_facts::version},
        {"commit", source_state::commit},
        {"dirty", source_state::dirty},
    };
}

}  // namespace trocar
