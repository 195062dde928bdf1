// Selection of the contacts that a response gets, by one rule for all responses.
#pragma once

#include <memory>
#include <vector>

#include "contact/contact_set.hpp"
#include "method/response.hpp"
#include "scene/world.hpp"

namespace trocar {

struct Parameter;
struct ResponseEntry;
class ParameterValues;

/// Vertex–face and edge–edge contacts pass if their gap at the tick's start is at most
///     contact_offset + look_ahead + 2 × closing motion of the tick.
/// The factor 2 covers tissue whose springs reverse its motion within the tick. Other contacts always pass.
class ContactSelection {
public:
    enum class Rule : std::uint8_t {
        look_ahead,  ///< the rule above
        all,         ///< every contact within the query distance
        scripts      ///< contacts that scripted motion alone closes within the tick; for ablations
    };
    struct Settings {
        Rule rule = Rule::look_ahead;
        double look_ahead = 0.1;      ///< mean edges of the tissue
        double contact_offset = 0.0;  ///< mean edges of the tissue; offset of the response's constraints
    };

    explicit ContactSelection(const Settings& settings) : settings_(settings) {}
    /// Pairs without tissue have edge length 0, so that only their closing motion counts.
    void prepare(const Topology& topology, const Materials& materials);
    [[nodiscard]] bool passes(const Frame& frame, double dt, const Contact& contact) const;

private:
    Settings settings_;
    std::vector<double> edge_;  ///< m, per body: mean edge of tissue, else 0
};

/// Parameter `look_ahead`, which the registry adds to every response.
Parameter look_ahead_parameter();
/// Response of `entry` behind the selection that `values` set. Contacts not passed on are counted in
/// ResponseOutput::skipped under SkipReason::apart.
std::unique_ptr<Response> make_selecting(const ResponseEntry& entry, const ParameterValues& values);

}  // namespace trocar
