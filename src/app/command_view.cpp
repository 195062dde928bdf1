// `trocar view`: a replay page of a scene, of a recording, or of a report's records.
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>

#include "app/commands.hpp"
#include "app/json_values.hpp"
#include "app/progress.hpp"
#include "app/view_pages.hpp"
#include "app/view_runs.hpp"
#include "geometry/input_error.hpp"
#include "geometry/whole_file.hpp"
#include "report/report.hpp"
#include "report/view_links.hpp"
#include "scene/recording.hpp"
#include "view/page.hpp"

namespace trocar::app {
namespace {

using Json = nlohmann::ordered_json;

/// A folder of a report, or its records themselves.
bool holds_records(const std::filesystem::path& input) {
    return std::filesystem::is_directory(input) || input.extension() == ".jsonl" || input.extension() == ".gz";
}

ViewProgress shared_progress(std::int64_t ticks) {
    return [progress = std::make_shared<Progress>("tick", ticks)](const std::string& run, std::int64_t done) {
        progress->show(done, run);
    };
}

ViewPage view_of_scene(const CommonOptions& common, const ViewOptions& options) {
    MethodChoice methods = options.methods;
    std::vector<RunSpec> specs;
    if (options.responses.empty()) specs.push_back(spec_of(methods));
    for (const std::string& response : options.responses) {
        methods.response = response;
        specs.push_back(spec_of(methods));
    }
    check_ticks(options.ticks);
    const Scene scene = read_scene(options.inputs.front(), common.data);
    ViewPage page = page_of(scene);
    if (options.ticks) page.ticks = std::min(page.ticks, *options.ticks);
    for (ViewedReference& reference : page.references) {
        reference.force.resize(std::min(reference.force.size(), static_cast<std::size_t>(page.ticks)));
    }
    for (RunSpec& spec : specs) {
        set_scene(scene, options.ticks, spec);
        add_run(scene, spec, nullptr, shared_progress(spec.ticks), page);
    }
    finish_page(specs, page);
    return page;
}

ViewPage view_of_records(const CommonOptions& common, const ViewOptions& options) {
    std::vector<Record> records;
    for (const std::filesystem::path& input : options.inputs) {
        if (!holds_records(input)) {
            throw InputError(input.string(), "", "a report's folder or its records beside another one",
                             "another kind of file");
        }
        for (Record& record : read_records(input)) records.push_back(std::move(record));
    }
    const std::vector<std::string> scenes = viewed_scenes(records);
    // --scene names a scene of the records, or gives its file where the records do not lead to it.
    const bool is_file = std::filesystem::is_regular_file(options.scene);
    const std::string name = is_file ? std::filesystem::path(options.scene).stem().string()
                                     : (options.scene.empty() && scenes.size() == 1 ? scenes.front() : options.scene);
    if (std::find(scenes.begin(), scenes.end(), name) == scenes.end()) {
        throw InputError("command line", "--scene",
                         scenes.empty() ? std::string("records of closed loops")
                                        : fmt::format("a scene of the records ({})", fmt::join(scenes, ", ")),
                         scenes.empty() ? std::string("none")
                         : name.empty() ? std::string("nothing")
                                        : fmt::format("'{}'", name));
    }
    const std::vector<const Record*> chosen = chosen_records(records, name, options.responses);
    const std::optional<std::filesystem::path> file =
        is_file ? std::filesystem::path(options.scene)
                : scene_file_of(*chosen.front(), study_folder_of(*chosen.front()));
    if (!file) {
        throw InputError(
            "command line", "--scene",
            fmt::format("the file of {}, where {} does not lead to it", name, chosen.front()->spec.scene_file),
            "a name");
    }
    return page_of_records(read_scene(*file, common.data), chosen, shared_progress(chosen.front()->spec.ticks));
}

/// A page for every scene of one report, in its folder.
int write_pages(const CommonOptions& common, const ViewOptions& options) {
    const std::filesystem::path& folder = options.inputs.front();
    if (options.inputs.size() != 1 || !std::filesystem::is_directory(folder)) {
        throw InputError("command line", "--pages", "the folder of one report", folder.string());
    }
    if (options.output || !options.scene.empty() || !options.responses.empty()) {
        throw InputError("command line", "--pages", "no --output, --scene or --response beside it", "one of them");
    }
    const std::vector<Record> records = read_records(folder);
    const std::size_t pages = write_view_pages(folder, records, study_folder_of(records.front()), common.data);
    if (common.json) {
        print_json_line(Json{{"folder", (folder / view_folder).string()}, {"pages", pages}});
    } else {
        fmt::print("{} pages in {}; trocar report {} links them\n", pages, (folder / view_folder).string(),
                   folder.string());
    }
    return done;
}

}  // namespace

int view(const CommonOptions& common, const ViewOptions& options) {
    if (options.pages) return write_pages(common, options);
    const std::filesystem::path& first = options.inputs.front();
    const bool records = holds_records(first);
    const bool recording = !records && is_recording(first, "a scene, a recording or a report");
    if (!records && options.inputs.size() > 1) {
        throw InputError("command line", "", "one scene, one recording, or folders of reports",
                         fmt::format("{} files", options.inputs.size()));
    }
    if (recording && !options.responses.empty()) {
        throw InputError("command line", "--response", "none for a recording, whose frames stand as they are",
                         fmt::format("'{}'", options.responses.front()));
    }
    if (!records && !options.scene.empty()) {
        throw InputError("command line", "--scene", "a report's folder to choose from", first.string());
    }
    const ViewPage page = records     ? view_of_records(common, options)
                          : recording ? page_of_recording(first)
                                      : view_of_scene(common, options);
    for (const ViewedRun& run : page.runs) {
        if (!run.note.empty()) fmt::print(stderr, "trocar: {}: {}: {}\n", page.scene, run.label, run.note);
        if (run.outcome != "ok") {
            fmt::print(stderr, "trocar: {}: {} ended as {}: {}\n", page.scene, run.label, run.outcome, run.message);
        }
    }
    for (const std::string& note : page.notes) fmt::print(stderr, "trocar: {}: {}\n", page.scene, note);
    const std::filesystem::path output = options.output.value_or(page_of_scene(page.scene));
    const std::string html = view_html(page, "");
    write_whole(output, html);
    if (common.json) {
        Json document{{"page", output.string()}, {"bytes", html.size()}, {"runs", Json::array()}};
        for (const ViewedRun& run : page.runs) {
            document["runs"].push_back(
                {{"label", run.label}, {"outcome", run.outcome}, {"message", run.message}, {"note", run.note}});
        }
        print_json_line(document);
    } else {
        fmt::print("Page: {} ({:.2f} MB)\n", output.string(), 1e-6 * static_cast<double>(html.size()));
    }
    return done;
}

}  // namespace trocar::app
