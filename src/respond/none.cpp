// Control, not a method: no response. Without contacts every response must give the same result as this one.
#include <memory>

#include "method/entry.hpp"

namespace trocar {
namespace {

class None final : public Response {
public:
    void prepare(const Topology& /*topology*/, const Materials& /*materials*/) override {}
    void respond(const Frame& /*frame*/, double /*dt*/, const ContactSet& /*contacts*/,
                 std::span<const ContactForce> /*contact_forces*/, ResponseOutput& output) override {
        output.clear();
    }
};

}  // namespace

ResponseEntry none_response() {
    ResponseEntry entry;
    entry.name = "none";
    entry.configuration = "a control, not a method: does nothing";
    entry.control = true;
    entry.make = [](const ParameterValues&) { return std::make_unique<None>(); };
    return entry;
}

}  // namespace trocar
