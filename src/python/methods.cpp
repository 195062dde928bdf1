// Detectors and responses written in Python: prototypes, since every call takes the interpreter's lock and copies.
#include <fmt/format.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <stdexcept>

#include "geometry/input_error.hpp"
#include "method/frame_check.hpp"
#include "method/outside.hpp"
#include "python/arrays.hpp"
#include "python/parts.hpp"
#include "python/response_values.hpp"

namespace trocar::python {
namespace {

/// The exception in one line, with the line of code that raised it. An interruption is raised again in the main thread.
std::string text_of(const py::error_already_set& error) {
    std::string text =
        fmt::format("{}: {}", std::string(py::str(error.type().attr("__name__"))), std::string(py::str(error.value())));
    py::object place = error.trace();
    while (place && !place.is_none() && !place.attr("tb_next").is_none()) place = place.attr("tb_next");
    if (place && !place.is_none()) {
        const std::filesystem::path file =
            std::string(py::str(place.attr("tb_frame").attr("f_code").attr("co_filename")));
        text += fmt::format(" ({}, line {})", file.filename().string(), place.attr("tb_lineno").cast<int>());
    }
    // At the end: other calls of the interpreter answer it.
    if (error.matches(PyExc_KeyboardInterrupt)) PyErr_SetInterrupt();
    return printable_line(text);
}

/// An object of a method's class; calls take the interpreter's lock.
class Instance {
public:
    explicit Instance(py::object object) : object_(std::move(object)) {}
    ~Instance() {  // NOLINT(bugprone-exception-escape): the interpreter ends the process instead
        const py::gil_scoped_acquire held;
        object_ = py::object();
    }
    Instance(const Instance&) = delete;
    Instance& operator=(const Instance&) = delete;
    Instance(Instance&&) = delete;
    Instance& operator=(Instance&&) = delete;

    /// Calls work(object) and returns the text of an exception, empty without one.
    template <typename Work>
    std::string call(Work&& work) {
        const py::gil_scoped_acquire held;
        try {
            work(object_);
        } catch (const py::error_already_set& error) {
            return text_of(error);
        } catch (const std::exception& error) {
            return error.what();
        }
        return {};
    }

private:
    py::object object_;
};

class PythonDetector final : public Detector {
public:
    PythonDetector(py::object object, bool query_distance)
        : object_(std::move(object)), has_query_distance_(query_distance) {}

    void prepare(const Topology& topology, const Frame& frame) override {
        topology_ = &topology;
        if (!is_answerable(topology, frame)) return;  // prepared by the first frame that is
        failure_ = prepare_object(frame);
        if (!failure_.empty()) throw std::runtime_error(failure_);
    }

    void update(const Frame& frame, double query_distance) override {
        query_distance_ = query_distance;
        failure_.clear();
        if (!is_answerable(*topology_, frame) || (query_distance > 0.0 && !has_query_distance_)) return;
        if (!is_prepared_) failure_ = prepare_object(frame);
        if (!failure_.empty()) return;
        failure_ = object_.call(
            [&](const py::object& object) { object.attr("update")(std::make_shared<Frame>(frame), query_distance); });
    }

    void detect(const Frame& frame, ContactSet& contacts) override {
        contacts.clear();
        contacts.query_distance = query_distance_;
        if (!check_frame(*topology_, frame, contacts)) return;
        if (!has_query_distance_ && !check_no_query_distance(query_distance_, contacts)) return;
        if (failure_.empty()) {
            failure_ = object_.call([&](const py::object& object) {
                take(object.attr("detect")(std::make_shared<Frame>(frame)), contacts);
            });
        }
        if (failure_.empty()) return;
        contacts.pairs.clear();
        contacts.near.clear();
        contacts.outcome = {OutcomeKind::threw, failure_};
    }

private:
    std::string prepare_object(const Frame& frame) {
        return object_.call([&](const py::object& object) {
            object.attr("prepare")(std::make_shared<Topology>(*topology_), std::make_shared<Frame>(frame));
            is_prepared_ = true;
        });
    }

    /// `answer`: pairs, or a tuple of pairs and near pairs.
    void take(const py::object& answer, ContactSet& contacts) const {
        const bool both = py::isinstance<py::tuple>(answer) && py::len(answer) == 2;
        const Index count = topology_->triangle_count();
        contacts.pairs = pairs_from(both ? py::object(answer[py::int_(0)]) : answer, "pairs", count);
        if (has_query_distance_ && query_distance_ != 0.0) {
            if (!both)
                throw InputError("detect", "", "a tuple (pairs, near) at a query distance above 0", "pairs alone");
            contacts.near = pairs_from(answer[py::int_(1)], "near", count);
        }
        contacts.sort();
    }

    Instance object_;
    const bool has_query_distance_;
    const Topology* topology_ = nullptr;
    bool is_prepared_ = false;
    double query_distance_ = 0.0;  ///< m
    std::string failure_;          ///< of prepare or update
};

class PythonResponse final : public Response {
public:
    explicit PythonResponse(py::object object) : object_(std::move(object)), solver_(object_) {}

    void prepare(const Topology& topology, const Materials& materials) override {
        vertex_count_ = topology.vertex_count;
        body_count_ = topology.bodies.size();
        const std::string failure = object_.call([&](const py::object& object) {
            object.attr("prepare")(std::make_shared<Topology>(topology), std::make_shared<Materials>(materials));
        });
        if (!failure.empty()) throw std::runtime_error(failure);
    }

    void respond(const Frame& frame, double dt, const ContactSet& contacts, std::span<const ContactForce> forces,
                 ResponseOutput& output) override {
        output.clear();
        const std::string failure = object_.call([&](const py::object& object) {
            // Without a base, NumPy copies.
            const py::array offered(contact_type(), contacts.contacts.size(), contacts.contacts.data());
            const py::array last(contact_force_type(), forces.size(), forces.data());
            take_answer(object.attr("respond")(std::make_shared<Frame>(frame), dt, offered, last), vertex_count_,
                        body_count_, output);
        });
        if (!failure.empty()) throw std::runtime_error(failure);
        if (std::any_of(output.contacts.begin(), output.contacts.end(),
                        [](const ContactForceLaw& law) { return law.role == ContactRole::solved; }))
            output.solver = &solver_;
        const auto offered = static_cast<std::int64_t>(contacts.contacts.size());
        const auto used = static_cast<std::int64_t>(output.contacts.size());
        if (used < offered) output.skip(SkipReason::not_handled, offered - used);
    }

private:
    class Solver final : public SubstepSolver {
    public:
        explicit Solver(Instance& object) : object_(object) {}
        void solve(PredictedStep& step) override {
            const std::string failure = object_.call([&](const py::object& object) { call_solve(object, step); });
            if (!failure.empty()) throw std::runtime_error(failure);
        }

    private:
        Instance& object_;
    };

    Instance object_;
    Solver solver_;
    Index vertex_count_ = 0;
    std::size_t body_count_ = 0;
};

py::array force_laws(py::ssize_t count) {
    if (count < 0) throw InputError("count", "", "an integer >= 0", fmt::format("{}", count));
    const std::vector<ContactForceLaw> laws(static_cast<std::size_t>(count));
    return {force_law_type(), count, laws.data()};
}

/// Class attribute parameters = {name: (default, unit, meaning)}.
std::vector<Parameter> parameters_of(const py::object& made) {
    constexpr double infinite = std::numeric_limits<double>::infinity();
    std::vector<Parameter> parameters;
    for (const auto& [name, value] : py::dict(made.attr("parameters"))) {
        const auto [number, unit, meaning] = value.cast<std::tuple<double, std::string, std::string>>();
        parameters.push_back(
            number_parameter(name.cast<std::string>(), unit, fmt::format("{}", number), -infinite, infinite, meaning));
    }
    return parameters;
}

/// Makes objects of the class with its parameters as keyword arguments. The class lives as long as the process: the
/// interpreter is gone when the registry is destroyed.
auto maker_of(const py::object& made, const std::vector<Parameter>& parameters) {
    const py::handle kept = py::object(made).release();
    return [kept, parameters](const ParameterValues& values) {
        py::dict given;
        for (const Parameter& one : parameters) given[py::str(one.name)] = values.number(one.name);
        try {
            return kept(**given);
        } catch (const py::error_already_set& error) {
            throw std::runtime_error(text_of(error));
        }
    };
}

std::string configuration_of(const py::object& made) {
    return fmt::format("class {} in Python: a slow prototype, not a timing",
                       std::string(py::str(made.attr("__qualname__"))));
}

void check_idle() {
    if (Computing::is_any()) throw InputError("a method", "", "no run under way while it joins", "one");
}

void register_detector(const std::string& name, const py::object& made, const std::string& version) {
    check_idle();
    const auto parameters = parameters_of(made);
    const bool query_distance = made.attr("query_distance").cast<bool>();
    add_outside_method(DetectorEntry{.name = name,
                                     .library = "Python",
                                     .version = version,
                                     .configuration = configuration_of(made),
                                     .claims_exact = made.attr("claims_exact").cast<bool>(),
                                     .query_distance = query_distance,
                                     .parameters = parameters,
                                     .make = [make = maker_of(made, parameters), query_distance](
                                                 const ParameterValues& values) -> std::unique_ptr<Detector> {
                                         const py::gil_scoped_acquire held;
                                         return std::make_unique<PythonDetector>(make(values), query_distance);
                                     }});
}

void register_response(const std::string& name, const py::object& made, const std::string& version) {
    check_idle();
    const auto parameters = parameters_of(made);
    ResponseEntry entry;
    entry.name = name;
    entry.library = "Python";
    entry.version = version;
    entry.configuration = configuration_of(made);
    entry.contact_generators = made.attr("contact_generators").cast<std::vector<std::string>>();
    for (const std::string& generator : entry.contact_generators)
        static_cast<void>(registry().contact_generator(generator));
    entry.parameters = parameters;
    entry.make = [make = maker_of(made, parameters)](const ParameterValues& values) -> std::unique_ptr<Response> {
        const py::gil_scoped_acquire held;
        return std::make_unique<PythonResponse>(make(values));
    };
    add_outside_method(std::move(entry));
}

}  // namespace

void add_methods(py::module_& module) {
    module.attr("CONTACT") = contact_type();
    module.attr("FORCE_LAW") = force_law_type();
    module.attr("CONTACT_FORCE") = contact_force_type();
    add_step(module);
    module.def("force_laws", &force_laws, py::arg("count"), R"((count,) array of trocar.FORCE_LAW with default values.

The force of a law acts on the weighted vertices along normal: k * -gap, damped by mu, evaluated by the stepper in
every sub-step. gap: m, at the start of the tick, negative inside; k: N/m; mu: N s/m; face_velocity: m/s. The reaction
goes to reaction_vertices (tissue) or to reaction_body at reaction_point (m, world). A law of role 4 has k = mu = 0; its
impulse comes from Response.solve. contact/response_output.hpp has all.)");
    module.def("register_detector", &register_detector);
    module.def("register_response", &register_response);
}

}  // namespace trocar::python
