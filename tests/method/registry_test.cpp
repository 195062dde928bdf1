#include "method/registry.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <set>
#include <string>

#include "geometry/input_error.hpp"
#include "method/device.hpp"

namespace trocar {
namespace {

TEST(ParseMethod, TakesNameAndParametersApart) {
    const MethodSpec spec = parse_method("fcl_bvh:update=refit,bv=AABB");
    EXPECT_EQ(spec.name, "fcl_bvh");
    EXPECT_EQ(spec.parameters.at("bv"), "AABB");
    EXPECT_EQ(spec.text(), "fcl_bvh:bv=AABB,update=refit");
}

TEST(ParseMethod, MalformedTextIsRefused) {
    for (const char* text : {"", ":a=b", "x:", "x:a", "x:a=", "x:=b", "x:a=1,a=2", "x:a=1,"}) {
        EXPECT_THROW(parse_method(text), InputError) << text;
    }
}

TEST(MakeDetector, TextMayHoldParametersAndTheMapWins) {
    EXPECT_NE(make_detector("ohc:hash_bits=4"), nullptr);
    EXPECT_THROW(make_detector("ohc:hash_bits=99"), InputError);
    EXPECT_THROW(make_detector("ohc:no_such_key=1"), InputError);
    EXPECT_NE(make_detector("ohc:hash_bits=99", {{"hash_bits", "4"}}), nullptr);
    EXPECT_THROW(make_detector("ohc:hash_bits=4", {{"hash_bits", "99"}}), InputError);
    EXPECT_NE(make_response("thesis:profile=corrected"), nullptr);
    EXPECT_THROW(make_response("thesis:profile=no_such_profile"), InputError);
}

TEST(ParameterValues, ChecksAgainstTheDeclaration) {
    const std::vector<Parameter> declared{{.name = "cell",
                                           .unit = "m",
                                           .default_value = "auto",
                                           .minimum = 0.0,
                                           .meaning = "cell edge",
                                           .words = {"auto"}},
                                          {.name = "bv",
                                           .type = Parameter::Type::choice,
                                           .default_value = "AABB",
                                           .choices = {"AABB", "OBB"},
                                           .meaning = ""},
                                          {.name = "n",
                                           .type = Parameter::Type::integer,
                                           .unit = "1",
                                           .default_value = "3",
                                           .minimum = 1.0,
                                           .meaning = ""}};
    const ParameterValues values("m", declared, {{"cell", "0.5"}});
    EXPECT_EQ(values.number("cell"), 0.5);
    EXPECT_EQ(values.integer("n"), 3);
    EXPECT_TRUE(values.is("bv", "AABB"));
    using Given = std::map<std::string, std::string>;
    for (const Given& bad : {Given{{"cell", "-1"}}, Given{{"cell", "nan"}}, Given{{"bv", "RSS"}}, Given{{"n", "1.5"}},
                             Given{{"n", "0"}}, Given{{"unknown", "1"}}}) {
        EXPECT_THROW(ParameterValues("m", declared, bad), InputError) << bad.begin()->second;
    }
}

/// What an input error says; empty when there is none.
template <typename Ask>
std::string complaint(Ask&& ask) {
    try {
        ask();
    } catch (const InputError& error) {
        return error.what();
    }
    return {};
}

TEST(ParameterValues, WhatLeftIsReportedWithWhatReplacedIt) {
    const std::vector<Parameter> declared{{.name = "way",
                                           .type = Parameter::Type::choice,
                                           .default_value = "short",
                                           .choices = {"short", "long"},
                                           .meaning = ""}};
    const std::vector<LeftSetting> left{{"speed", "take the other"}, {"way=round", "take the bus"}, {"way", "wrong"}};
    const auto asked = [&](const std::string& key, const std::string& value) {
        return complaint([&] { ParameterValues("m", declared, {{key, value}}, left); });
    };
    EXPECT_EQ(asked("speed", "1"), "m has no parameter 'speed' any more: take the other");
    EXPECT_EQ(asked("way", "round"), "m has no 'way=round' any more: take the bus");
    EXPECT_EQ(asked("way", "long"), "") << "what is declared is there, whatever the list says";
    EXPECT_NE(asked("way", "back").find("expected short|long"), std::string::npos) << asked("way", "back");
    EXPECT_NE(asked("sped", "1").find("expected one of way"), std::string::npos) << asked("sped", "1");
}

TEST(Registry, EveryResponseReportsWhatTheDeviceTookOver) {
    for (const ResponseEntry& entry : registry().responses()) {
        for (const char* moved : {"tip", "saturation", "rate", "filter", "ramp"}) {
            const std::string key = std::string(moved) == "tip" ? "tip" : std::string("tip_") + moved;
            const std::string reported = complaint([&] { make_response(entry.name, {{key, "1"}}); });
            EXPECT_EQ(reported.rfind(entry.name + " has no parameter '" + key + "' any more", 0), 0U) << reported;
            EXPECT_NE(reported.find(std::string("--device ") + moved + "="), std::string::npos) << reported;
        }
        const std::string filter = complaint([&] { make_response(entry.name, {{"velocity_filter", "150"}}); });
        EXPECT_NE(filter.find("any more: nothing takes its place"), std::string::npos) << filter;
    }
}

TEST(Registry, WhatLeftAResponseIsDeclaredNoMore) {
    std::size_t reported = 0;
    for (const ResponseEntry& entry : registry().responses()) {
        std::set<std::string> once;
        for (const LeftSetting& gone : entry.left) {
            EXPECT_TRUE(once.insert(gone.setting).second) << entry.name << " reports twice of " << gone.setting;
            EXPECT_FALSE(gone.replaced.empty()) << entry.name << ": " << gone.setting;
            const std::size_t equals = gone.setting.find('=');
            const std::string name = gone.setting.substr(0, equals);
            const auto declared = std::find_if(entry.parameters.begin(), entry.parameters.end(),
                                               [&](const Parameter& parameter) { return parameter.name == name; });
            ++reported;
            if (equals == std::string::npos) {
                EXPECT_EQ(declared, entry.parameters.end()) << entry.name << " declares '" << name << "' still";
                continue;
            }
            // A value that left alone: its parameter is there, its word is not.
            ASSERT_NE(declared, entry.parameters.end()) << entry.name << ": " << gone.setting;
            for (const auto* words : {&declared->choices, &declared->words}) {
                EXPECT_EQ(std::count(words->begin(), words->end(), gone.setting.substr(equals + 1)), 0)
                    << entry.name << " takes '" << gone.setting << "' still";
            }
        }
    }
    EXPECT_GT(reported, left_every_response().size() * registry().responses().size()) << "no response of its own";
}

TEST(Device, IsReadAsParametersOfAMethodAre) {
    const TipSettings plain = read_device("");
    EXPECT_TRUE(plain.fulcrum);
    EXPECT_EQ(plain.saturation, 8.5);
    for (const double off : {plain.rate_limit, plain.filter, plain.ramp}) EXPECT_EQ(off, 0.0);
    const TipSettings all = read_device("ramp=0.005,tip=sum,saturation=3.25,rate=500,filter=150");
    EXPECT_FALSE(all.fulcrum);
    EXPECT_EQ(all.saturation, 3.25);
    EXPECT_EQ(all.rate_limit, 500.0);
    EXPECT_EQ(all.filter, 150.0);
    EXPECT_EQ(all.ramp, 0.005);
    EXPECT_EQ(text_of(all), "tip=sum,saturation=3.25,rate=500,filter=150,ramp=0.005");
    EXPECT_EQ(text_of(read_device(text_of(plain))), text_of(plain));
    for (const char* bad : {"tip", "tip=", "=sum", "tip=sum,", "tip=sum,tip=sum", "tip=shaft", "rate=-1", "rate=fast",
                            "colour=red", "tip_rate=500"}) {
        const std::string reported = complaint([&] { read_device(bad); });
        EXPECT_EQ(reported.rfind("device: ", 0), 0U) << bad << ": " << reported;
        EXPECT_EQ(reported.find('\n'), std::string::npos) << reported;
    }
}

TEST(Registry, RefusesADuplicateName) {
    Registry registry;
    registry.add(DetectorEntry{.name = "twice"});
    EXPECT_THROW(registry.add(DetectorEntry{.name = "twice"}), std::logic_error);
    EXPECT_THROW(registry.add_absent_detector({"twice", "because"}), std::logic_error);
}

TEST(Registry, AbsentMethodIsNamedWithItsReason) {
    Registry registry;
    registry.add_absent_detector({"lost", "library not found"});
    try {
        (void)registry.detector("lost");
        FAIL() << "an absent method was handed out";
    } catch (const InputError& error) {
        EXPECT_NE(std::string(error.what()).find("library not found"), std::string::npos) << error.what();
    }
}

}  // namespace
}  // namespace trocar
