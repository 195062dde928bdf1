#include "contract/response_methods.hpp"

#include <algorithm>

#include "contract/contract_support.hpp"
#include "contract/shipped_folder.hpp"
#include "method/outside.hpp"
#include "support/methods.hpp"
#include "support/scene_samples.hpp"
#include "support/test_name.hpp"

namespace trocar::test {

std::string ResponseMethod::name() const { return test_name(method + "_" + source); }

std::string detector_for(const ContactGeneratorEntry& source) {
    std::string found;  // of ours the last, which is the fastest
    for (const DetectorEntry& entry : registry().detectors()) {
        if (source.wants_native ? entry.native_contacts : entry.own && entry.claims_exact && !entry.control) {
            // Methods from outside are tested, they test nobody.
            const auto& outside = outside_methods();
            if (std::find(outside.begin(), outside.end(), entry.name) != outside.end()) continue;
            if (why_unreported(entry, source).empty()) found = entry.name;
        }
    }
    return found;
}

std::vector<ResponseMethod> response_methods() {
    std::vector<ResponseMethod> list;
    for (const ResponseEntry& entry : registry().responses()) {
        if (entry.control) continue;
        for (const std::string& method : variants_of(entry, {"profile", "setting"})) {
            for (const std::string& source : entry.contact_generators) {
                const ContactGeneratorEntry& from = registry().contact_generator(source);
                if (!why_unreadable(from, parse_method(method)).empty() || detector_for(from).empty()) continue;
                list.push_back({method, source});
            }
        }
    }
    return list;
}

Scene quick_scene(const std::string& name, double faster) {
    Scene scene = read_scene(shipped_folder() / "scenes" / (name + ".json"), std::nullopt);
    speed_up(scene, faster);
    return scene;
}

void expect_kept(const ResponseMethod& who, const std::string& check, const std::string& failures) {
    // A gap of every response on a contact generator stands under its name alone.
    expect_kept("response_contract", {who.name(), "*_" + who.source}, check, failures);
}

}  // namespace trocar::test
