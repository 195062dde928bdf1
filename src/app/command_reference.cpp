// `trocar reference`: makes the stored references of scenes, except where this very program has made them already, or
// checks whether they still belong to them.
#include <fmt/format.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "app/commands.hpp"
#include "app/json_values.hpp"
#include "geometry/input_error.hpp"
#include "geometry/whole_file.hpp"
#include "measure/environment.hpp"
#include "reference/build_reference.hpp"
#include "simulate/overrides.hpp"

namespace trocar::app {
namespace {

using Json = nlohmann::ordered_json;

const char* word_of(ReferenceState state) {
    static constexpr std::array words{"present", "missing", "stale"};
    return words.at(static_cast<std::size_t>(state));
}

Json solution_json(const ReferenceSolution& solution) {
    return {
        {"available", solution.available},
        {"reason", solution.reason},
        {"until", json_number(solution.until)},
        {"residual", json_number(solution.residual)},
        {"order_time_step", json_number(solution.order_time_step)},
        {"order_stiffness", json_number(solution.order_stiffness)},
        {"force_bound", json_number(solution.force_bound)},
        {"impulse_bound", json_number(solution.impulse_bound)},
        {"position_bound", json_number(solution.position_bound)},
        {"max_strain", json_number(solution.max_strain)},
        {"max_strain_time", json_number(solution.max_strain_time)},
        {"final_strain", json_number(solution.final_strain)},
        {"strain_range", Json::array({json_number(solution.strain_range[0]), json_number(solution.strain_range[1])})},
        {"clears_within_strain_limit",
         solution.clears_within_strain_limit ? Json(*solution.clears_within_strain_limit) : Json(nullptr)}};
}

Reference computed(const Scene& scene) {
    return build_reference(scene, {},
                           [&](const std::string& what) { fmt::print(stderr, "{}: {}\n", scene.name, what); });
}

/// That a scene has no reference is stored too, with the reason: it then is neither missing nor forgotten.
Reference declared_absent(const Scene& scene, const std::string& reason) {
    Reference made;
    made.scene = scene.name;
    made.scene_hash = fmt::format("{:016x}", scene.hash);
    made.turned_k = scene.turned_k;
    made.origin["settings"] = "none";
    made.origin["seed"] = "none";
    made.hard.reason = reason;
    made.equal_k.reason = reason;
    return made;
}

/// Whether the stored reference was made from this state of the scene by this very program, built from a clean commit.
bool made_by_this_program(const Scene& scene, const std::string& command) {
    const FoundReference found = find_reference(scene);
    if (found.state != ReferenceState::present) return false;
    const auto& origin = found.reference.origin;
    const auto same = [&](const char* key, const std::string& value) {
        const auto stored = origin.find(key);
        return stored != origin.end() && stored->second == value;
    };
    const auto here = environment();
    return same("command", command) && same("dirty", "no") && here.at("dirty") == "no" &&
           same("commit", here.at("commit")) && same("compiler", here.at("compiler"));
}

}  // namespace

int reference(const CommonOptions& common, const ReferenceOptions& options) {
    Json answers = Json::array();
    bool all_fit = true;
    for (const std::filesystem::path& file : options.scenes) {
        if (lacks_data(file, common.data)) {
            fmt::print(stderr, "trocar: {}: left out (no data; name its folder with --data)\n", file.string());
            continue;
        }
        Scene scene = read_scene(file, common.data);
        if (scene.contact_off) {
            throw InputError(file.filename().string(), "/contact_off",
                             "contact at every tick of a scene with a reference",
                             fmt::format("none from {} to {} s", scene.contact_off->from, scene.contact_off->to));
        }
        if (options.k) {
            apply_overrides(fmt::format("k={}", *options.k), scene);
            if (std::isnan(scene.turned_k)) {
                throw InputError("--k", file.filename().string(), "another stiffness than the scene's own",
                                 fmt::format("{}", *options.k));
            }
        }
        const std::filesystem::path target = reference_file(file, scene.turned_k);
        std::string command = fmt::format("trocar reference {}", file.filename().string());
        if (options.k) command += fmt::format(" --k {}", *options.k);
        if (!options.without.empty()) command += " --without";
        // An interrupted row of scenes goes on where it was.
        if (!options.check && !made_by_this_program(scene, command)) {
            Reference made = options.without.empty() ? computed(scene) : declared_absent(scene, options.without);
            const auto origin = environment();
            for (const char* key : {"commit", "dirty", "version", "compiler"}) made.origin[key] = origin.at(key);
            made.origin["command"] = command;
            std::error_code error;
            std::filesystem::create_directories(target.parent_path(), error);
            write_whole(target, to_json(made));
        }
        const FoundReference found = find_reference(scene);
        all_fit = all_fit && found.state == ReferenceState::present;
        if (common.json) {
            Json answer{{"scene", scene.name},
                        {"file", target.string()},
                        {"state", word_of(found.state)},
                        {"message", found.message()},
                        {"hard", solution_json(found.reference.hard)},
                        {"equal_k", solution_json(found.reference.equal_k)}};
            answers.push_back(answer);
        } else {
            fmt::print("{:<16} {:<8} {}\n", scene.name, word_of(found.state), found.message());
        }
        std::fflush(stdout);
    }
    if (common.json) print_json_line(Json{{"references", answers}});
    return all_fit ? done : comparison_failed;
}

}  // namespace trocar::app
