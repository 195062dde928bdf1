// Runs: a whole one with its record, and a simulation that is stepped from Python.
#include <fmt/format.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <chrono>
#include <map>
#include <memory>
#include <stdexcept>

#include "app/run_choice.hpp"
#include "app/shipped.hpp"
#include "geometry/input_error.hpp"
#include "measure/record.hpp"
#include "measure/row_columns.hpp"
#include "python/arrays.hpp"
#include "python/parts.hpp"
#include "report/report.hpp"
#include "simulate/runs.hpp"
#include "simulate/simulation.hpp"

namespace trocar::python {
namespace {

using OptionalPath = std::optional<std::filesystem::path>;

// ---- columns of ticks ----

struct Column {
    std::string unit;
    std::string code;           ///< NumPy's
    std::ptrdiff_t offset = 0;  ///< bytes, in a StepRow
};

/// In the order of the row.
const std::vector<std::pair<std::string, Column>>& columns() {
    static const auto all = [] {
        std::vector<std::pair<std::string, Column>> list;
        const StepRow row;
        const auto add = [&](const std::string& name, const char* unit, const auto& member) {
            list.push_back({name, {unit, code_of(member), offset_in(row, member)}});
        };
        visit_row(row, add);
        visit_unstored_row(row, add);
        return list;
    }();
    return all;
}

const Column& column_named(const std::string& name) {
    static const std::map<std::string, Column> by_name(columns().begin(), columns().end());
    const auto found = by_name.find(name);
    if (found == by_name.end()) throw py::key_error(name);
    return found->second;
}

py::object value_of_column(const StepRow& row, const std::string& name) {
    const Column& column = column_named(name);
    const char* place = reinterpret_cast<const char*>(&row) + column.offset;
    if (column.code == "f8") return py::float_(*reinterpret_cast<const double*>(place));
    if (column.code == "i8") return py::int_(*reinterpret_cast<const std::int64_t*>(place));
    if (column.code == "?") return py::bool_(*reinterpret_cast<const bool*>(place));
    return py::str(std::string(name_of(*reinterpret_cast<const OutcomeKind*>(place))));
}

/// Views on the members of the rows, which `base` keeps alive.
py::dict columns_of(const std::vector<StepRow>& rows, const py::handle& base) {
    py::dict result;
    for (const auto& [name, column] : columns()) {
        const char* first = rows.empty() ? nullptr : reinterpret_cast<const char*>(rows.data()) + column.offset;
        result[py::str(name)] = view_of(py::dtype(column.code), {static_cast<py::ssize_t>(rows.size())},
                                        {static_cast<py::ssize_t>(sizeof(StepRow))}, first, base);
    }
    return result;
}

// ---- a whole run ----

/// A record and, of a run made here, the last frame.
struct Run {
    Record record;
    Matrix3X positions = Matrix3X(3, 0);  ///< m, world
};

/// RunSpec and environment as a record has them, as JSON.
std::string facts_of_run(const Run& run) {
    Record facts;
    facts.spec = run.record.spec;
    facts.environment = run.record.environment;
    return to_json_line(facts);
}

py::dict summary_of(const Record& record) {
    py::dict summary;
    for (const auto& [metric, value] : record.summary) summary[py::str(std::string(info_of(metric).name))] = value;
    return summary;
}

/// Asks the interpreter for a pending interruption, at most every 20 ms, since another thread may hold its lock. Owns
/// the exception that a handler raised.
class Interruption {
public:
    bool go_on() {
        const auto now = std::chrono::steady_clock::now();
        if (now - last_ < std::chrono::milliseconds(20)) return true;
        last_ = now;
        const py::gil_scoped_acquire held;
        if (PyErr_CheckSignals() == 0) return true;
        raised_.emplace();
        return false;
    }
    /// Call with the interpreter's lock.
    void raise_if_any() {
        if (raised_) throw py::error_already_set(*raised_);
        if (PyErr_CheckSignals() != 0) throw py::error_already_set();
    }

private:
    std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
    std::optional<py::error_already_set> raised_;
};

app::MethodChoice choice_of(const std::string& detector, const std::string& contacts, const std::string& response,
                            const std::string& stepper, const std::string& device) {
    return {.detector = detector, .response = response, .contacts = contacts, .stepper = stepper, .device = device};
}

std::shared_ptr<Run> run(const std::filesystem::path& file, const std::string& detector, const std::string& contacts,
                         const std::string& response, const std::string& stepper, const std::string& device,
                         std::optional<std::int64_t> ticks, std::int64_t truth_stride, const OptionalPath& data) {
    app::check_ticks(ticks);
    if (truth_stride < 0) throw InputError("truth_stride", "", "an integer >= 0", fmt::format("{}", truth_stride));
    auto result = std::make_shared<Run>();
    Interruption interruption;
    {
        const Computing computing;
        RunSpec spec = app::spec_of(choice_of(detector, contacts, response, stepper, device));
        spec.truth_stride = truth_stride;
        const Scene scene = read_scene(app::find_scene(file), data_folder(data));
        app::set_scene(scene, ticks, spec);
        RunLimits limits;
        limits.progress = [&interruption](std::int64_t) { return interruption.go_on(); };
        limits.observe = [&](const Simulation& simulation, const StepRow& row) {
            const bool is_last = row.tick + 1 == spec.ticks || !simulation.outcome().ok();
            if (is_last) result->positions = simulation.frame().position;
        };
        result->record = run_closed_loop(scene, spec, limits);
        if (result->positions.cols() == 0) result->positions = scene.first.position;
    }
    interruption.raise_if_any();
    return result;
}

std::vector<std::shared_ptr<Run>> read_runs(const std::filesystem::path& folder) {
    const Computing computing;
    std::vector<std::shared_ptr<Run>> runs;
    for (Record& record : read_records(folder)) {
        runs.push_back(std::make_shared<Run>());
        runs.back()->record = std::move(record);
    }
    return runs;
}

// ---- a simulation step by step ----

/// Memory of pairs and contacts that a view still refers to when the next detection begins.
struct ViewedAnswer {
    std::vector<TrianglePair> pairs = {};
    std::vector<Contact> contacts = {};
};

/// Leaves the memory of a viewed answer to the views, so that no view refers to freed memory.
class ViewedDetector final : public Detector {
public:
    ViewedDetector(std::unique_ptr<Detector> detector, std::weak_ptr<ViewedAnswer>& viewed)
        : detector_(std::move(detector)), viewed_(&viewed) {}
    void prepare(const Topology& topology, const Frame& frame) override { detector_->prepare(topology, frame); }
    void update(const Frame& frame, double query_distance) override { detector_->update(frame, query_distance); }
    void detect(const Frame& frame, ContactSet& contacts) override {
        if (const auto viewed = viewed_->lock()) {
            viewed->pairs = std::move(contacts.pairs);
            viewed->contacts = std::move(contacts.contacts);
            viewed_->reset();
        }
        detector_->detect(frame, contacts);
    }

private:
    std::unique_ptr<Detector> detector_;
    std::weak_ptr<ViewedAnswer>* viewed_;
};

class SteppedSimulation {
public:
    SteppedSimulation(const std::filesystem::path& file, const app::MethodChoice& choice, const OptionalPath& data)
        : spec_(app::spec_of(choice)), scene_(read_scene(app::find_scene(file), data_folder(data))) {
        if (const std::string reason = why_not_combined(spec_); !reason.empty()) throw InputError(reason);
        simulation_.emplace(scene_, std::make_unique<ViewedDetector>(make_detector(spec_.detector), viewed_),
                            make_response(spec_.response), registry().contact_generator(spec_.contacts),
                            simulation_settings(spec_));
    }

    StepRow step() {
        check_idle();
        struct Stepping {
            bool& flag;
            ~Stepping() { flag = false; }  // under the interpreter's lock again
        };
        is_stepping_ = true;
        const Stepping stepping{is_stepping_};
        StepRow row;
        {
            const Computing computing;
            row = simulation_->step();
        }
        if (row.outcome == OutcomeKind::ok) ++ticks_;
        return row;
    }

    [[nodiscard]] const Simulation& idle() const {
        check_idle();
        return *simulation_;
    }
    [[nodiscard]] const Scene& scene() const { return scene_; }
    [[nodiscard]] std::int64_t ticks() const { return ticks_; }

    /// Owner of views on pairs and contacts: keeps the simulation, or the memory that it has left to them.
    py::capsule viewed(const py::object& self) {
        std::shared_ptr<ViewedAnswer> viewed = viewed_.lock();
        if (!viewed) viewed_ = viewed = std::make_shared<ViewedAnswer>();
        using Owner = std::pair<py::object, std::shared_ptr<ViewedAnswer>>;
        return {new Owner(self, std::move(viewed)), [](void* pointer) { delete static_cast<Owner*>(pointer); }};
    }

private:
    void check_idle() const {
        if (is_stepping_) throw std::runtime_error("a step of this simulation is under way in another thread");
    }

    RunSpec spec_;
    Scene scene_;
    std::weak_ptr<ViewedAnswer> viewed_;
    std::optional<Simulation> simulation_;
    std::int64_t ticks_ = 0;
    bool is_stepping_ = false;  ///< read and written under the interpreter's lock
};

std::unique_ptr<SteppedSimulation> make_simulation(const std::filesystem::path& file, const std::string& detector,
                                                   const std::string& contacts, const std::string& response,
                                                   const std::string& stepper, const std::string& device,
                                                   const OptionalPath& data) {
    const Computing computing;
    return std::make_unique<SteppedSimulation>(file, choice_of(detector, contacts, response, stepper, device), data);
}

/// Read-only property: positions of one of the simulation's frames.
void add_positions(py::class_<SteppedSimulation>& of, const char* name, const Frame& (Simulation::*frame)() const,
                   Matrix3X Frame::*points) {
    of.def_property_readonly(name, [frame, points](const py::object& self) {
        return view_of((self.cast<const SteppedSimulation&>().idle().*frame)().*points, self);
    });
}

py::dict metric_units() {
    py::dict units;
    for (const MetricInfo& info : metrics()) units[py::str(std::string(info.name))] = py::str(std::string(info.unit));
    return units;
}

}  // namespace

std::optional<std::filesystem::path> data_folder(const OptionalPath& given) {
    const char* variable = std::getenv("TROCAR_DATA");
    if (given || variable == nullptr || *variable == '\0') return given;
    return variable;
}

void add_simulation(py::module_& module) {
    py::class_<StepRow> row(module, "Tick",
                            R"(One tick as a mapping from column to value; dict(tick) has them all.

Names and units are those of trocar.Result.columns. A number that is not known is NaN, a count -1.)");
    row.def("__getitem__", &value_of_column);
    row.def("__len__", [](const StepRow&) { return columns().size(); });
    row.def("keys", [](const StepRow&) {
        py::list names;
        for (const auto& [name, column] : columns()) names.append(name);
        return names;
    });
    row.def("__iter__", [](const py::object& self) { return py::iter(self.attr("keys")()); });

    py::class_<Run, std::shared_ptr<Run>> record(module, "Record");
    record.def("columns", [](const py::object& self) { return columns_of(self.cast<const Run&>().record.rows, self); });
    record.def_property_readonly("facts", &facts_of_run);
    record.def_property_readonly("run_id", [](const Run& run) { return run_id(run.record.spec); });
    record.def_property_readonly("summary", [](const Run& run) { return summary_of(run.record); });
    record.def_property_readonly("outcome", [](const Run& run) { return name_of(run.record.outcome.kind); });
    record.def_property_readonly("message", [](const Run& run) { return run.record.outcome.message; });
    record.def_property_readonly("state_hash", [](const Run& run) { return run.record.state_hash; });
    record.def_property_readonly(
        "positions", [](const py::object& self) { return view_of(self.cast<const Run&>().positions, self); });
    module.def("run", &run);
    module.def("read_records", &read_runs, py::arg("folder"));
    module.def("metric_units", &metric_units);
    module.def("column_units", [] {
        py::dict units;
        for (const auto& [name, column] : columns()) units[py::str(name)] = column.unit;
        return units;
    });
    module.def("outcome_words", [] {
        py::list words;
        for (auto kind = OutcomeKind::ok; kind <= OutcomeKind::crashed;
             kind = static_cast<OutcomeKind>(static_cast<int>(kind) + 1)) {
            words.append(name_of(kind));
        }
        return words;
    });

    py::class_<SteppedSimulation> simulation(module, "Simulation");
    simulation.def(py::init(&make_simulation), py::arg("scene"), py::arg("detector"), py::arg("contacts"),
                   py::arg("response"), py::arg("stepper"), py::arg("device"), py::arg("data"));
    simulation.def("step", &SteppedSimulation::step);
    add_positions(simulation, "positions", &Simulation::frame, &Frame::position);
    add_positions(simulation, "velocities", &Simulation::frame, &Frame::velocity);
    add_positions(simulation, "detected_positions", &Simulation::seen, &Frame::position);
    simulation.def_property_readonly("pairs", [](const py::object& self) {
        auto& one = self.cast<SteppedSimulation&>();
        return view_of(one.idle().contacts().pairs, one.viewed(self));
    });
    simulation.def_property_readonly("contacts", [](const py::object& self) {
        auto& one = self.cast<SteppedSimulation&>();
        return view_of(one.idle().contacts().contacts, one.viewed(self));
    });
    simulation.def_property_readonly("outcome",
                                     [](const SteppedSimulation& one) { return name_of(one.idle().outcome().kind); });
    simulation.def_property_readonly("message",
                                     [](const SteppedSimulation& one) { return one.idle().outcome().message; });
    simulation.def_property_readonly("ticks", &SteppedSimulation::ticks);
    simulation.def_property_readonly("dt", [](const SteppedSimulation& one) { return one.scene().dt; });
    simulation.def_property_readonly(
        "topology", [](const SteppedSimulation& one) { return std::make_shared<Topology>(one.scene().topology); });
}

}  // namespace trocar::python
