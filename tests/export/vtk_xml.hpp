// A reader of the XML files that ParaView reads, written for tests: small, strict, and without any code of src/export.
#pragma once

#include <cstdint>
#include <cstring>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

#include "support/base64.hpp"

namespace trocar::test {

struct XmlElement {
    std::string tag;
    std::map<std::string, std::string> attributes;
    std::string text;
    std::vector<XmlElement> inner;

    [[nodiscard]] const XmlElement& child(const std::string& wanted) const {
        for (const XmlElement& one : inner) {
            if (one.tag == wanted) return one;
        }
        throw std::runtime_error("no <" + wanted + "> in <" + tag + ">");
    }
    [[nodiscard]] const XmlElement& named(const std::string& name) const {
        for (const XmlElement& one : inner) {
            if (one.attributes.contains("Name") && one.attributes.at("Name") == name) return one;
        }
        throw std::runtime_error("no array '" + name + "' in <" + tag + ">");
    }
    [[nodiscard]] std::size_t count(const std::string& name) const { return std::stoul(attributes.at(name)); }
};

/// Throws std::runtime_error for what is not well-formed: tags that do not match, attributes without quotes or given
/// twice, text after the end.
class XmlText {
public:
    static XmlElement read(const std::string& text) {
        XmlText reader(text);
        reader.expect("<?xml version=\"1.0\"?>");
        reader.blanks();
        XmlElement root = reader.element();
        reader.blanks();
        if (reader.at_ != text.size()) reader.fail("the end");
        return root;
    }

private:
    explicit XmlText(const std::string& text) : text_(text) {}
    [[noreturn]] void fail(const std::string& wanted) const {
        throw std::runtime_error("byte " + std::to_string(at_) + ": expected " + wanted);
    }
    void expect(const std::string& word) {
        if (text_.compare(at_, word.size(), word) != 0) fail(word);
        at_ += word.size();
    }
    void blanks() {
        while (at_ < text_.size() && std::isspace(static_cast<unsigned char>(text_[at_])) != 0) ++at_;
    }
    std::string word() {
        const std::size_t start = at_;
        while (at_ < text_.size() && (std::isalnum(static_cast<unsigned char>(text_[at_])) != 0 || text_[at_] == '_'))
            ++at_;
        if (at_ == start) fail("a name");
        return text_.substr(start, at_ - start);
    }
    XmlElement element() {
        expect("<");
        XmlElement one;
        one.tag = word();
        for (blanks(); text_.at(at_) != '>' && text_.at(at_) != '/'; blanks()) {
            const std::string name = word();
            expect("=\"");
            const std::size_t end = text_.find_first_of("\"<", at_);
            if (end == std::string::npos || text_[end] == '<') fail("a closing quote");
            if (!one.attributes.emplace(name, text_.substr(at_, end - at_)).second) fail("an attribute once");
            at_ = end + 1;
        }
        if (text_[at_] == '/') {
            expect("/>");
            return one;
        }
        expect(">");
        while (true) {
            const std::size_t next = text_.find('<', at_);
            if (next == std::string::npos) fail("</" + one.tag + ">");
            one.text += text_.substr(at_, next - at_);
            at_ = next;
            if (text_.compare(at_, 2, "</") == 0) break;
            one.inner.push_back(element());
        }
        expect("</" + one.tag + ">");
        return one;
    }
    const std::string& text_;
    std::size_t at_ = 0;
};

/// Values of an inline binary array; its own head must state its size.
template <typename Value>
std::vector<Value> values_of(const XmlElement& array) {
    const std::map<std::size_t, std::string> type{{8, std::is_integral_v<Value> ? "Int64" : "Float64"},
                                                  {4, std::is_integral_v<Value> ? "Int32" : "Float32"}};
    if (array.attributes.at("type") != type.at(sizeof(Value)) || array.attributes.at("format") != "binary") {
        throw std::runtime_error(array.attributes.at("Name") + " is of type " + array.attributes.at("type"));
    }
    const std::string bytes = from_base64(array.text);
    std::uint64_t size = 0;
    if (bytes.size() < sizeof size) throw std::runtime_error("an array without its head");
    std::memcpy(&size, bytes.data(), sizeof size);
    if (size != bytes.size() - sizeof size || size % sizeof(Value) != 0)
        throw std::runtime_error("an array of wrong size");
    std::vector<Value> values(size / sizeof(Value));
    if (!values.empty()) std::memcpy(values.data(), bytes.data() + sizeof size, size);
    return values;
}

}  // namespace trocar::test
