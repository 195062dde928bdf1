// `trocar schema`: prints the formats by which anyone drives trocar with his own files.
#include <fmt/format.h>

#include "app/commands.hpp"
#include "geometry/input_error.hpp"
#include "scene/recording.hpp"
#include "scene/scene.hpp"
#include "study/study.hpp"

namespace trocar::app {

int schema(const CommonOptions& /*common*/, const SchemaOptions& options) {
    if (options.what == "scene") {
        fmt::print("{}", scene_schema());
    } else if (options.what == "study") {
        fmt::print("{}", study_schema());
    } else if (options.what == "recording") {
        fmt::print("{}", recording_schema());
    } else {
        throw InputError("command line", "schema", "scene, study or recording", "'" + options.what + "'");
    }
    return done;
}

}  // namespace trocar::app
