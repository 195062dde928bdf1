// The one rule by which contacts of a generator are passed on to a response, the same for every response.
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

/// Passes a contact on when its gap at the start of the tick is at most
///     contact offset + look-ahead + 2 × the closing motion of the tick.
/// The factor 2 covers tissue that its springs turn round within the tick. Contacts of triangles that meet always pass.
class ContactSelection {
public:
    enum class Rule : std::uint8_t {
        look_ahead,  ///< the rule above
        all,         ///< every contact within the query distance
        scripts      ///< what scripts alone close within the tick, for ablations
    };
    struct Settings {
        Rule rule = Rule::look_ahead;
        double look_ahead = 0.1;      ///< mean edges of the tissue
        double contact_offset = 0.0;  ///< mean edges of the tissue, at which the response holds features apart
    };

    explicit ContactSelection(const Settings& settings) : settings_(settings) {}
    /// Lengths of pairs without tissue are 0: their look-ahead is the closing motion.
    void prepare(const Topology& topology, const Materials& materials);
    [[nodiscard]] bool passes(const Frame& frame, double dt, const Contact& contact) const;

private:
    Settings settings_;
    std::vector<double> edge_;  ///< m, per body: mean edge of tissue, else 0
};

/// `look_ahead`, which the registry adds to the parameters of every response.
Parameter look_ahead_parameter();
/// The response as its entry makes it, behind the selection that its values ask for. Contacts that are not passed on
/// are counted in ResponseOutput::skipped under SkipReason::apart.
std::unique_ptr<Response> make_selecting(const ResponseEntry& entry, const ParameterValues& values);

}  // namespace trocar
