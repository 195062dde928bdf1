#include "method/registry.hpp"

#include <gtest/gtest.h>

#include "geometry/input_error.hpp"

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
