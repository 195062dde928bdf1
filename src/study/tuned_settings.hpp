// Settings that `trocar tune` found, in studies that name its file. A response {"tuned": METHOD} stands for the method
// with its parameters written out.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace trocar {

/// Gives every response {"tuned": METHOD} of the study's experiments its method, setting, basis and contacts. They
/// are in the file that the study's key "tuned" names, relative to the study. The entry is that of its stepper,
/// or of the one in its key "searched_with". A response without a better setting than the one it comes with gets that
/// one; contacts of its own stay. Throws InputError.
void resolve_tuned(nlohmann::json& study, const std::string& study_file);

}  // namespace trocar
