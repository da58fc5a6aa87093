#include "mesh/format/vtk_xml.hpp"

#include "mesh/format/byte_order.hpp"
#include "mesh/format/number_scanner.hpp"

#include <algorithm>
#include <map>
#include <zlib.h>

namespace amontons {
namespace {

// ---- elements ----------------------------------------------------------------------------

using Attributes = std::map<std::string, std::string, std::less<>>;

std::string unescaped(std::string_view text)
{
    constexpr std::pair<std::string_view, char> kEntities[] = {
        {"&lt;", '<'}, {"&gt;", '>'}, {"&quot;", '"'}, {"&apos;", '\''}, {"&amp;", '&'}};
    std::string out;
    for (std::size_t i = 0; i < text.size();) {
        const auto at =
            std::find_if(std::begin(kEntities), std::end(kEntities),
                         [&](const auto& e) { return text.substr(i).starts_with(e.first); });
        out += at != std::end(kEntities) ? at->second : text[i];
        i += at != std::end(kEntities) ? at->first.size() : 1;
    }
    return out;
}

bool is_white_space(char c)
{
    return static_cast<unsigned char>(c) <= ' ';
}

bool is_name(char c)
{
    return !is_white_space(c) && c != '>' && c != '/' && c != '=' && c != '<' && c != '"';
}

class XmlReader {
public:
    XmlReader(std::string_view bytes, std::string_view type, FileIssues& issues)
        : text_(bytes)
        , type_(type)
        , issues_(issues)
    {
    }

    VtkXmlFile read()
    {
        while (!done_) {
            const std::size_t open = text_.find('<', at_);
            if (open == std::string_view::npos) refuse("the end of the file", "</VTKFile>");
            keep_text(text_.substr(at_, open - at_));
            pass_to(open);
            const std::string_view rest = text_.substr(at_);
            if (rest.starts_with("<?"))
                pass_over("?>");
            else if (rest.starts_with("<!--"))
                pass_over("-->");
            else if (rest.starts_with("<!"))
                pass_over(">");
            else if (rest.starts_with("</"))
                read_end();
            else
                read_begin();
        }
        return std::move(file_);
    }

private:
    [[noreturn]] void refuse(std::string found, std::string allowed)
    {
        issues_.fatal(line_place(line_), std::move(found), std::move(allowed));
    }

    void pass_to(std::size_t at)
    {
        line_ += static_cast<std::size_t>(
            std::count(text_.begin() + static_cast<std::ptrdiff_t>(at_),
                       text_.begin() + static_cast<std::ptrdiff_t>(at), '\n'));
        at_ = at;
    }

    void pass_over(std::string_view mark)
    {
        const std::size_t end = text_.find(mark, at_);
        if (end == std::string_view::npos) refuse("the end of the file", quoted_text(mark));
        pass_to(end + mark.size());
    }

    void keep_text(std::string_view text)
    {
        if (open_.empty() || open_.back() != "DataArray" || !in_array_) return;
        if (std::all_of(text.begin(), text.end(), is_white_space)) return;
        if (text.size() > array_.text.size()) array_.text = text;
    }

    void read_begin()
    {
        std::size_t i = at_ + 1;
        const auto name_at = [&] {
            const std::size_t start = i;
            while (i < text_.size() && is_name(text_[i]))
                ++i;
            return text_.substr(start, i - start);
        };
        const auto skip_blanks = [&] {
            while (i < text_.size() && is_white_space(text_[i]))
                ++i;
        };
        const std::string name(name_at());
        if (name.empty()) refuse(quoted_text(text_.substr(at_, 10)), "an element");
        Attributes attributes;
        for (skip_blanks(); i < text_.size() && text_[i] != '>' && text_[i] != '/'; skip_blanks()) {
            const std::string key(name_at());
            skip_blanks();
            if (key.empty() || i >= text_.size() || text_[i] != '=')
                refuse("an attribute of " + quoted_text(name) + " without a value",
                       "name=\"value\"");
            ++i;
            skip_blanks();
            const char quote = i < text_.size() ? text_[i] : ' ';
            const std::size_t end =
                quote == '"' || quote == '\'' ? text_.find(quote, i + 1) : std::string_view::npos;
            if (end == std::string_view::npos)
                refuse("an attribute of " + quoted_text(name) + " without a value",
                       "name=\"value\"");
            attributes[key] = unescaped(text_.substr(i + 1, end - i - 1));
            i = end + 1;
        }
        const bool empty = i < text_.size() && text_[i] == '/';
        if (empty) ++i;
        if (i >= text_.size() || text_[i] != '>')
            refuse(i >= text_.size() ? "the end of the file" : quoted_text(text_.substr(i, 1)),
                   "\">\"");
        begin(name, attributes, i + 1);
        pass_to(std::max(at_, i + 1));
        if (done_) return;
        open_.push_back(name);
        if (open_.size() > 32) refuse("elements within elements", "fewer than 32 levels");
        if (empty) end_of(name);
    }

    void read_end()
    {
        const std::size_t close = text_.find('>', at_);
        if (close == std::string_view::npos) refuse("the end of the file", "\">\"");
        std::string_view name = text_.substr(at_ + 2, close - at_ - 2);
        while (!name.empty() && is_white_space(name.back()))
            name.remove_suffix(1);
        if (open_.empty() || open_.back() != name)
            refuse("</" + std::string(name.substr(0, 40)) + ">",
                   open_.empty() ? "an element" : "</" + open_.back() + ">");
        pass_to(close + 1);
        end_of(std::string(name));
    }

    std::uint64_t number(const Attributes& attributes, const char* key, std::uint64_t missing)
    {
        const auto at = attributes.find(key);
        if (at == attributes.end()) return missing;
        const auto value = parse_integer(at->second);
        if (!value || *value < 0)
            refuse(std::string(key) + "=" + quoted_text(at->second), "a whole number >= 0");
        return static_cast<std::uint64_t>(*value);
    }

    static std::string text_of(const Attributes& attributes, const char* key, const char* missing)
    {
        const auto at = attributes.find(key);
        return at == attributes.end() ? missing : at->second;
    }

    void begin(const std::string& name, const Attributes& attributes, std::size_t behind)
    {
        if (open_.empty() && name != "VTKFile") refuse(quoted_text(name), "VTKFile");
        if (name == "VTKFile" && open_.empty()) {
            read_head(attributes);
        } else if (name == "Piece") {
            in_piece_ = true;
            file_.pieces.push_back({number(attributes, "NumberOfPoints", 0),
                                    number(attributes, "NumberOfCells", 0),
                                    line_place(line_),
                                    {}});
        } else if (name == "DataArray" && in_piece_) {
            array_ = {};
            array_.name = text_of(attributes, "Name", "");
            array_.type = text_of(attributes, "type", "");
            array_.format = text_of(attributes, "format", "ascii");
            array_.components =
                std::max<std::uint64_t>(number(attributes, "NumberOfComponents", 1), 1);
            array_.offset = number(attributes, "offset", 0);
            array_.parent = open_.back();
            array_.place = line_place(line_);
            in_array_ = true;
        } else if (name == "AppendedData") {
            read_appended(attributes, behind);
        }
    }

    void read_head(const Attributes& attributes)
    {
        if (const std::string type = text_of(attributes, "type", ""); type != type_)
            refuse("a file of type " + quoted_text(type), quoted_text(type_));
        const std::string order = text_of(attributes, "byte_order", "LittleEndian"),
                          header = text_of(attributes, "header_type", "UInt32"),
                          compressor = text_of(attributes, "compressor", "");
        if (order != "LittleEndian" && order != "BigEndian")
            refuse("byte_order " + quoted_text(order), "LittleEndian or BigEndian");
        if (header != "UInt32" && header != "UInt64")
            refuse("header_type " + quoted_text(header), "UInt32 or UInt64");
        if (!compressor.empty() && compressor != "vtkZLibDataCompressor")
            refuse("compressor " + quoted_text(compressor), "vtkZLibDataCompressor or none");
        file_.big_endian = order == "BigEndian";
        file_.header_bytes = header == "UInt64" ? 8 : 4;
        file_.compressed = !compressor.empty();
    }

    /// What follows is no XML: all that is left, but for the end of the file.
    void read_appended(const Attributes& attributes, std::size_t behind)
    {
        const std::string encoding = text_of(attributes, "encoding", "base64");
        if (encoding != "raw" && encoding != "base64")
            refuse("encoding " + quoted_text(encoding), "raw or base64");
        const std::size_t mark = text_.find('_', behind);
        std::string_view end = text_;
        while (!end.empty() && is_white_space(end.back()))
            end.remove_suffix(1);
        const std::size_t close = end.rfind("</AppendedData");
        if (mark == std::string_view::npos || close == std::string_view::npos || close <= mark ||
            !end.ends_with("</VTKFile>"))
            refuse("appended data without an end", "</AppendedData> and </VTKFile>");
        file_.appended = text_.substr(mark + 1, close - mark - 1);
        file_.appended_raw = encoding == "raw";
        done_ = true;
    }

    void end_of(const std::string& name)
    {
        open_.pop_back();
        if (name == "DataArray" && in_array_ && (open_.empty() || open_.back() != "DataArray")) {
            file_.pieces.back().arrays.push_back(std::move(array_));
            array_ = {};
            in_array_ = false;
        }
        if (name == "Piece") in_piece_ = false;
        if (open_.empty()) done_ = true;
    }

    std::string_view text_, type_;
    FileIssues& issues_;
    std::size_t at_ = 0, line_ = 1;
    std::vector<std::string> open_;
    VtkXmlFile file_;
    VtkXmlArray array_;
    bool in_piece_ = false, in_array_ = false, done_ = false;
};

// ---- numbers -----------------------------------------------------------------------------

int bytes_of(const std::string& type)
{
    constexpr std::pair<const char*, int> kTypes[] = {
        {"Float64", 8}, {"Float32", 4}, {"Int64", 8},  {"UInt64", 8}, {"Int32", 4},
        {"UInt32", 4},  {"Int16", 2},   {"UInt16", 2}, {"Int8", 1},   {"UInt8", 1}};
    for (const auto& [name, bytes] : kTypes)
        if (type == name) return bytes;
    return 0;
}

/// Bytes as they stand, or out of base64. A new stretch of base64 may begin after any padding:
/// VTK encodes the sizes in front by themselves, others together with what follows.
class ByteStream {
public:
    ByteStream(std::string_view data, bool raw) : data_(data), raw_(raw) {}

    /// The next n bytes; fewer at the end.
    std::string take(std::uint64_t n)
    {
        if (raw_) {
            const std::string out(data_.substr(
                0, static_cast<std::size_t>(std::min<std::uint64_t>(n, data_.size()))));
            data_.remove_prefix(out.size());
            return out;
        }
        std::string out;
        out.reserve(static_cast<std::size_t>(std::min<std::uint64_t>(n, data_.size())));
        while (out.size() < n) {
            if (left_ == 0 && !decode_group()) break;
            out += group_[3 - left_--];
        }
        return out;
    }

private:
    static int value_of(char c)
    {
        if (c >= 'A' && c <= 'Z') return c - 'A';
        if (c >= 'a' && c <= 'z') return c - 'a' + 26;
        if (c >= '0' && c <= '9') return c - '0' + 52;
        return c == '+' ? 62 : c == '/' ? 63 : c == '=' ? -1 : -2;
    }

    /// Four letters to up to three bytes, put at the end of group_.
    bool decode_group()
    {
        std::array<int, 4> v{};
        for (std::size_t i = 0; i < 4; ++i) {
            while (!data_.empty() && is_white_space(data_[0]))
                data_.remove_prefix(1);
            if (data_.empty()) return false;
            v[i] = value_of(data_[0]);
            if (v[i] == -2) return false;
            data_.remove_prefix(1);
        }
        if (v[0] < 0 || v[1] < 0 || (v[2] < 0 && v[3] >= 0)) return false;
        const std::size_t count = v[2] < 0 ? 1 : v[3] < 0 ? 2 : 3;
        const auto bits = static_cast<std::uint32_t>(v[0] << 18 | v[1] << 12 |
                                                     std::max(v[2], 0) << 6 | std::max(v[3], 0));
        for (std::size_t i = 0; i < count; ++i)
            group_[3 - count + i] = static_cast<char>(bits >> (16 - 8 * i) & 255);
        left_ = count;
        return true;
    }

    std::string_view data_;
    bool raw_;
    std::array<char, 3> group_{};
    std::size_t left_ = 0;
};

class ArrayReader {
public:
    ArrayReader(const VtkXmlFile& file, const VtkXmlArray& array, FileIssues& issues)
        : file_(file)
        , array_(array)
        , issues_(issues)
    {
    }

    /// The array's bytes, which must be `size`.
    std::string bytes(std::uint64_t size)
    {
        const bool appended = array_.format == "appended";
        if (!appended && array_.format != "binary")
            refuse("format " + quoted_text(array_.format), "ascii, binary or appended");
        if (appended && array_.offset > file_.appended.size())
            refuse("offset " + std::to_string(array_.offset),
                   "at most " + std::to_string(file_.appended.size()));
        ByteStream stream(appended ? file_.appended.substr(static_cast<std::size_t>(array_.offset))
                                   : array_.text,
                          appended && file_.appended_raw);
        return file_.compressed ? compressed(stream, size) : plain(stream, size);
    }

    [[noreturn]] void refuse(const std::string& found, std::string allowed)
    {
        issues_.fatal(array_.place, "array " + quoted_text(array_.name) + " with " + found,
                      std::move(allowed));
    }

private:
    std::uint64_t read_size(ByteStream& stream)
    {
        const auto n = static_cast<std::size_t>(file_.header_bytes);
        const std::string bytes = stream.take(n);
        if (bytes.size() < n)
            refuse("the end of its data", "a size of " + std::to_string(n) + " bytes");
        return n == 8 ? read_bytes<std::uint64_t>(bytes.data(), file_.big_endian)
                      : read_bytes<std::uint32_t>(bytes.data(), file_.big_endian);
    }

    void check_size(std::uint64_t found, std::uint64_t size)
    {
        if (found != size)
            refuse(std::to_string(found) + " bytes", std::to_string(size) + " bytes");
    }

    std::string plain(ByteStream& stream, std::uint64_t size)
    {
        check_size(read_size(stream), size);
        std::string out = stream.take(size);
        check_size(out.size(), size);
        return out;
    }

    // Sizes: blocks, bytes of a block, bytes of the last (0: as the others), compressed bytes of
    // each block.
    std::string compressed(ByteStream& stream, std::uint64_t size)
    {
        constexpr std::uint64_t kMostRatio = 1100; // zlib reaches 1032
        const std::uint64_t blocks = read_size(stream), whole = read_size(stream),
                            last = read_size(stream);
        if (blocks == 0) {
            check_size(0, size);
            return "";
        }
        const std::uint64_t room = file_.appended.size() + array_.text.size();
        if (blocks > room || whole > room * kMostRatio || last > whole)
            refuse(std::to_string(blocks) + " blocks of " + std::to_string(whole) + " bytes",
                   "what the file can hold");
        std::vector<std::uint64_t> packed;
        for (std::uint64_t b = 0; b < blocks; ++b)
            packed.push_back(read_size(stream));
        if (whole == 0 || size / whole > blocks) check_size(whole * blocks, size);
        check_size((blocks - 1) * whole + (last == 0 ? whole : last), size);
        std::string out;
        for (std::uint64_t b = 0; b < blocks; ++b) {
            const std::string in = stream.take(packed[static_cast<std::size_t>(b)]);
            const std::uint64_t expected = b + 1 == blocks && last > 0 ? last : whole;
            if (in.size() < packed[static_cast<std::size_t>(b)] ||
                expected > in.size() * kMostRatio)
                refuse("a block of " + std::to_string(in.size()) + " bytes",
                       std::to_string(packed[static_cast<std::size_t>(b)]) + " bytes that hold " +
                           std::to_string(expected));
            const std::size_t start = out.size();
            out.resize(start + static_cast<std::size_t>(expected));
            auto length = static_cast<uLongf>(expected);
            const int status = ::uncompress(reinterpret_cast<Bytef*>(out.data() + start), &length,
                                            reinterpret_cast<const Bytef*>(in.data()),
                                            static_cast<uLong>(in.size()));
            if (status != Z_OK || length != expected)
                refuse("a block that zlib cannot read",
                       "a block of " + std::to_string(expected) + " bytes, compressed");
        }
        return out;
    }

    const VtkXmlFile& file_;
    const VtkXmlArray& array_;
    FileIssues& issues_;
};

template <class Out>
std::vector<Out> numbers(const VtkXmlFile& file, const VtkXmlArray& array, std::uint64_t count,
                         FileIssues& issues)
{
    ArrayReader reader(file, array, issues);
    const int size = bytes_of(array.type);
    if (size == 0)
        reader.refuse("type " + quoted_text(array.type), "Float32, Float64 or Int8 to UInt64");
    std::vector<Out> out;
    if (array.format == "ascii") {
        out.reserve(static_cast<std::size_t>(std::min<std::uint64_t>(count, array.text.size())));
        NumberScanner text(array.text);
        while (!text.at_end()) {
            Out value = 0;
            bool fine = false;
            if constexpr (std::is_same_v<Out, double>)
                fine = text.number(value);
            else
                fine = text.integer(value);
            if (!fine) reader.refuse(quoted_text(text.refused()), "numbers");
            out.push_back(value);
            if (out.size() > count) break;
        }
        if (out.size() != count)
            reader.refuse((out.size() > count ? "more than " + std::to_string(count)
                                              : std::to_string(out.size())) +
                              " numbers",
                          std::to_string(count) + " numbers");
        return out;
    }
    if (count > std::uint64_t{1} << 50) reader.refuse(std::to_string(count) + " numbers", "fewer");
    const std::string bytes = reader.bytes(count * static_cast<std::uint64_t>(size));
    out.reserve(static_cast<std::size_t>(count));
    const auto convert = [&]<class In>(In) {
        for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i)
            out.push_back(
                static_cast<Out>(read_bytes<In>(&bytes[i * sizeof(In)], file.big_endian)));
    };
    const std::string& t = array.type;
    if (t == "Float64")
        convert(double{});
    else if (t == "Float32")
        convert(float{});
    else if (t == "Int64")
        convert(std::int64_t{});
    else if (t == "UInt64")
        convert(std::uint64_t{});
    else if (t == "Int32")
        convert(std::int32_t{});
    else if (t == "UInt32")
        convert(std::uint32_t{});
    else if (t == "Int16")
        convert(std::int16_t{});
    else if (t == "UInt16")
        convert(std::uint16_t{});
    else if (t == "Int8")
        convert(std::int8_t{});
    else
        convert(std::uint8_t{});
    return out;
}

} // namespace

const VtkXmlArray* VtkXmlPiece::find(std::string_view parent, std::string_view name) const
{
    for (const VtkXmlArray& a : arrays)
        if (a.parent == parent && (name.empty() || a.name == name)) return &a;
    return nullptr;
}

VtkXmlFile parse_vtk_xml(std::string_view bytes, std::string_view type, FileIssues& issues)
{
    return XmlReader(without_byte_order_mark(bytes), type, issues).read();
}

bool is_whole_number(const VtkXmlArray& array)
{
    return array.type.find("Int") != std::string::npos;
}

std::vector<double> vtk_doubles(const VtkXmlFile& file, const VtkXmlArray& array,
                                std::uint64_t count, FileIssues& issues)
{
    return numbers<double>(file, array, count, issues);
}

std::vector<std::int64_t> vtk_integers(const VtkXmlFile& file, const VtkXmlArray& array,
                                       std::uint64_t count, FileIssues& issues)
{
    if (!is_whole_number(array))
        issues.fatal(array.place,
                     "array " + quoted_text(array.name) + " of type " + quoted_text(array.type),
                     "whole numbers");
    return numbers<std::int64_t>(file, array, count, issues);
}

} // namespace amontons
