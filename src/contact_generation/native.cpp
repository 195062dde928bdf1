// Contact generator `native`: a library's own contacts as reported, without identity across ticks.
#include <memory>

#include "contact_generation/pair_contacts.hpp"
#include "method/entry.hpp"

namespace trocar {
namespace {

class Native final : public ContactGenerator {
public:
    void prepare(const Topology& topology, const Frame& /*first*/) override { topology_ = &topology; }

    void gather(const Frame& frame, ContactSet& contacts) override {
        contacts.contacts.assign(contacts.native.begin(), contacts.native.end());
        const TickStart start(*topology_, frame);
        for (Contact& contact : contacts.contacts) place_at_start(start, contact);
    }

private:
    const Topology* topology_ = nullptr;
};

}  // namespace

ContactGeneratorEntry native_contact_generator() {
    ContactGeneratorEntry entry;
    entry.name = "native";
    entry.version = "1";
    entry.meaning = "the library's own contacts";
    entry.wants_native = true;
    entry.make = [](const ParameterValues&) { return std::make_unique<Native>(); };
    return entry;
}

}  // namespace trocar
