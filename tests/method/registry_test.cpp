#include "method/registry.hpp"

#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

#include "geometry/input_error.hpp"
#include "method/device.hpp"
#include "method/outside.hpp"
#include "support/text.hpp"

namespace trocar {
namespace {

using test::complaint_of;

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
    EXPECT_NE(make_detector("blind:hide=0.5"), nullptr);
    EXPECT_THROW(make_detector("blind:hide=2"), InputError);
    EXPECT_THROW(make_detector("ohc:no_such_key=1"), InputError);
    EXPECT_NE(make_detector("blind:hide=2", {{"hide", "0.5"}}), nullptr);
    EXPECT_THROW(make_detector("blind:hide=0.5", {{"hide", "2"}}), InputError);
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

TEST(ParameterValues, ARetiredNameIsReportedWithItsReplacementOnceItIsUndeclared) {
    const Parameter contacts{.name = "contacts",
                             .type = Parameter::Type::choice,
                             .default_value = "implicit",
                             .choices = {"implicit", "explicit"},
                             .meaning = ""};
    const auto asked = [](const std::string& method, const std::vector<Parameter>& declared, const std::string& key,
                          const std::string& value) {
        return complaint_of([&] { ParameterValues(method, declared, {{key, value}}); });
    };
    EXPECT_EQ(asked("thesis", {contacts}, "clamp", "on"),
              "thesis: parameter 'clamp': expected one of contacts, got 'clamp': it belongs to the profile, "
              "profile=faithful, corrected or printed");
    EXPECT_EQ(asked("thesis", {contacts}, "contacts", "hold"),
              "thesis: parameter 'contacts': expected implicit|explicit, got 'hold': renamed to 'zero_order_hold'");
    EXPECT_EQ(asked("thesis", {contacts}, "contacts", "explicit"), "");
    EXPECT_EQ(asked("other", {contacts}, "clamp", "on"),
              "other: parameter 'clamp': expected one of contacts, got 'clamp'");
    const Parameter clamp{.name = "clamp", .default_value = "1", .meaning = ""};
    EXPECT_EQ(asked("thesis", {clamp}, "clamp", "2"), "") << "a declared name is in use, whatever the table has";
}

TEST(Registry, ARetiredMethodIsReportedWithItsNewName) {
    const auto ends_with = [](const std::string& text, const std::string& end) {
        EXPECT_TRUE(text.ends_with(end)) << text;
        EXPECT_NE(text.find(": expected one of "), std::string::npos) << text;
    };
    ends_with(complaint_of([] { make_response("hold"); }), ", got 'hold': renamed to 'unilateral'");
    ends_with(complaint_of([] { make_response("xpbd:k=1"); }), ", got 'xpbd': renamed to 'xpbd_contact'");
    ends_with(complaint_of([] { make_contact_generator("near"); }), ", got 'near': renamed to 'proximity'");
    ends_with(complaint_of([] { make_stepper("regional"); }), ", got 'regional': renamed to 'adaptive_multires'");
    ends_with(complaint_of([] { make_detector("ohc:incremental=on"); }),
              ", got 'incremental': take the detector ohc_clustered");
    ends_with(complaint_of([] { make_detector("hold"); }), ", got 'hold'");
    EXPECT_NE(make_stepper("xpbd"), nullptr) << "the name of a response alone is retired";
}

TEST(Registry, ARetiredNameThatIsRegisteredIsInUse) {
    Registry registry;
    registry.add(ContactGeneratorEntry{.name = "near"});
    EXPECT_EQ(registry.contact_generator("near").name, "near");
}

TEST(Registry, EveryResponseReportsWhatTheDeviceTookOver) {
    for (const ResponseEntry& entry : registry().responses()) {
        for (const char* moved : {"tip", "saturation", "rate", "filter", "ramp"}) {
            const std::string key = std::string(moved) == "tip" ? "tip" : std::string("tip_") + moved;
            const std::string reported = complaint_of([&] { make_response(entry.name, {{key, "1"}}); });
            EXPECT_EQ(reported.rfind(entry.name + ": parameter '" + key + "': expected ", 0), 0U) << reported;
            EXPECT_TRUE(reported.ends_with("'" + key + "': give the run's device, --device " + moved + "=…"))
                << reported;
        }
        const std::string filter = complaint_of([&] { make_response(entry.name, {{"velocity_filter", "150"}}); });
        EXPECT_NE(filter.find("got 'velocity_filter': nothing takes its place"), std::string::npos) << filter;
    }
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
        const std::string reported = complaint_of([&] { read_device(bad); });
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
    test::expect_holds(complaint_of([&registry] { (void)registry.detector("lost"); }), {"library not found"});
}

TEST(OutsideMethods, JoinAtAnyTimeAndReplaceThemselvesAlone) {
    const std::size_t before = registry().detectors().size();
    add_outside_method(DetectorEntry{.name = "late", .version = "1"});
    add_outside_method(DetectorEntry{.name = "late", .version = "2"});
    EXPECT_EQ(registry().detectors().size(), before + 1);
    EXPECT_EQ(registry().detector("late").version, "2");
    EXPECT_EQ(outside_methods(), std::vector<std::string>{"late"});
    ResponseEntry response;
    response.name = "ohc";  // a response may be called as a detector is
    add_outside_method(std::move(response));
    for (const char* name : {"ohc", "brute_force"}) {
        const std::string version = registry().detector(name).version;
        test::expect_holds(
            complaint_of([name] { add_outside_method(DetectorEntry{.name = name, .version = "another"}); }), {name});
        EXPECT_EQ(registry().detector(name).version, version);
    }
}

}  // namespace
}  // namespace trocar
