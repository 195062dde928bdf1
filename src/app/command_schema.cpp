// `trocar schema`: prints the formats by which anyone drives trocar with his own files.
#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "app/commands.hpp"
#include "geometry/input_error.hpp"
#include "measure/metrics.hpp"
#include "scene/recording.hpp"
#include "scene/scene.hpp"
#include "study/contact_baseline.hpp"
#include "study/study.hpp"

namespace trocar::app {
namespace {

/// The list of metrics, as results.csv, the report's glossary and `run --json` use it.
std::string figures_document() {
    nlohmann::ordered_json list = nlohmann::ordered_json::array();
    for (const MetricInfo& figure : metrics()) {
        list.push_back({{"name", figure.name},
                        {"unit", figure.unit},
                        {"better", name_of(figure.better)},
                        {"meaning", figure.meaning},
                        {"source", text_of(figure.source)}});
    }
    return list.dump(2) + "\n";
}

}  // namespace

int schema(const CommonOptions& /*common*/, const SchemaOptions& options) {
    if (options.what == "scene") {
        fmt::print("{}", scene_schema());
    } else if (options.what == "study") {
        fmt::print("{}", study_schema());
    } else if (options.what == "recording") {
        fmt::print("{}", recording_schema());
    } else if (options.what == "baseline") {
        fmt::print("{}", contact_baseline_schema());
    } else if (options.what == "figures") {
        fmt::print("{}", figures_document());
    } else {
        throw InputError("command line", "schema", "scene, study, recording, baseline or figures",
                         "'" + options.what + "'");
    }
    return done;
}

}  // namespace trocar::app
