#include <algorithm>
#include <utility>

#include "errors.hpp"
#include "json.hpp"
#include "text.hpp"

namespace icp2d {
namespace {

/// RFC 8259, section 6: [ - ] ( 0 | 1–9 *digit ) [ . 1*digit ] [ e [ + | - ] 1*digit ]
bool is_json_number(std::string_view text) {
    const auto skip_one_of = [&text](std::string_view characters) {
        if (text.empty() || characters.find(text.front()) == std::string_view::npos) return false;
        text.remove_prefix(1);
        return true;
    };
    const auto skip_digits = [&] {
        const bool any = skip_one_of("0123456789");
        while (skip_one_of("0123456789")) {}
        return any;
    };
    skip_one_of("-");
    if (!skip_one_of("0") && !skip_digits()) return false;
    if (skip_one_of(".") && !skip_digits()) return false;
    if (skip_one_of("eE")) {
        skip_one_of("+-");
        if (!skip_digits()) return false;
    }
    return text.empty();
}

class FlatJsonReader {
public:
    explicit FlatJsonReader(const std::filesystem::path& file)
        : file_(file), text_(read_text(file)) {}

    std::vector<JsonMember> object() {
        std::vector<JsonMember> members;
        expect('{');
        if (!accept('}')) {
            do {
                members.push_back(member());
                const JsonMember& last = members.back();
                const auto same = [&](const JsonMember& other) { return other.key == last.key; };
                if (!std::none_of(members.begin(), members.end() - 1, same)) {
                    fail("the key " + shown(last.key) + " comes twice");
                }
            } while (accept(','));
            expect('}');
        }
        skip_blanks();
        if (at_ < text_.size()) fail("text after the object");
        return members;
    }

private:
    JsonMember member() {
        expect('"');
        const auto end = std::min(text_.find('"', at_), text_.size());
        std::string key = text_.substr(at_, end - at_);
        at_ = end;
        expect('"');
        const auto at_line = line();
        expect(':');
        return {std::move(key), value(), at_line};
    }

    std::optional<double> value() {
        skip_blanks();
        const auto end = std::min(text_.find_first_of(" \t\r\n,}", at_), text_.size());
        const std::string word = text_.substr(at_, end - at_);
        const auto number = is_json_number(word) ? to_number(word) : std::nullopt;
        if (!number && word != "null") {
            fail("expected a finite number or null, got " + shown(word));
        }
        at_ = end;
        return number;
    }

    void skip_blanks() { at_ = std::min(text_.find_first_not_of(" \t\r\n", at_), text_.size()); }

    bool accept(char wanted) {
        skip_blanks();
        if (at_ == text_.size() || text_[at_] != wanted) return false;
        ++at_;
        return true;
    }

    void expect(char wanted) {
        if (accept(wanted)) return;
        fail("expected " + shown({&wanted, 1}) + ", got " +
             (at_ < text_.size() ? shown({&text_[at_], 1}) : "the end of the file"));
    }

    std::size_t line() const {
        const auto here = text_.begin() + static_cast<std::ptrdiff_t>(at_);
        return 1 + static_cast<std::size_t>(std::count(text_.begin(), here, '\n'));
    }

    [[noreturn]] void fail(const std::string& what) const { throw InputError(file_, line(), what); }

    std::filesystem::path file_;
    std::string text_;
    std::size_t at_ = 0;
};

}  // namespace

std::vector<JsonMember> read_flat_json(const std::filesystem::path& file) {
    return FlatJsonReader(file).object();
}

}  // namespace icp2d
