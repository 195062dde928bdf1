#include "method/device.hpp"

#include <fmt/format.h>

#include "method/registry.hpp"

namespace trocar {

const std::vector<Parameter>& device_parameters() {
    const auto limiter = [](const char* name, const char* unit, const char* value, double maximum,
                            const char* meaning) {
        return Parameter{
            .name = name, .unit = unit, .default_value = value, .minimum = 0.0, .maximum = maximum, .meaning = meaning};
    };
    static const std::vector<Parameter> parameters{
        choice_parameter(
            "tip", "fulcrum", {"fulcrum", "sum"},
            "force shown at the tip: through the trocar as pivot where the body has one, or the plain sum"),
        limiter("saturation", "N", "8.5", 1e6, "largest force that the device shows; 0: no limit"),
        limiter("rate", "N/s", "0", 1e9, "largest change of the shown force (500 is usual); 0: off"),
        limiter("filter", "Hz", "0", 1e6, "low-pass on the shown force (150 is usual); 0: off"),
        limiter("ramp", "s", "0", 10.0,
                "time in which the shown force rises after contact begins (0.005 is usual); 0: off")};
    return parameters;
}

TipSettings read_device(const std::map<std::string, std::string>& given) {
    const ParameterValues values("device", device_parameters(), given);
    return {.fulcrum = values.is("tip", "fulcrum"),
            .saturation = values.number("saturation"),
            .rate_limit = values.number("rate"),
            .filter = values.number("filter"),
            .ramp = values.number("ramp")};
}

TipSettings read_device(std::string_view text) {
    if (text.empty()) return read_device(std::map<std::string, std::string>{});
    return read_device(parse_settings(text, [text](const std::string& found) {
        return InputError("device", "", "key=value[,key=value...]", fmt::format("'{}' ({})", text, found));
    }));
}

std::string text_of(const TipSettings& device) {
    return fmt::format("tip={},saturation={},rate={},filter={},ramp={}", device.fulcrum ? "fulcrum" : "sum",
                       device.saturation, device.rate_limit, device.filter, device.ramp);
}

}  // namespace trocar
