#include "solver/step/byte_stream.hpp"
#include "solver/step/stepped_scene.hpp"

// A step's record as bytes.

namespace amontons {
namespace {

constexpr std::size_t kMost = 1u << 28;

void put(ByteWriter& out, const std::string& text)
{
    out.vector(std::vector<char>(text.begin(), text.end()));
}

std::string get_text(ByteReader& in)
{
    const std::vector<char> text = in.vector<char>(kMost);
    return {text.begin(), text.end()};
}

void put(ByteWriter& out, const Vec3& v)
{
    for (int k = 0; k < 3; ++k)
        out.value(v[k]);
}

Vec3 get_vector(ByteReader& in)
{
    Vec3 v;
    for (int k = 0; k < 3; ++k)
        v[k] = in.value<double>();
    return v;
}

void put(ByteWriter& out, const ContactRecord& c)
{
    for (const Vec3* v : {&c.point, &c.force, &c.normal, &c.slip})
        put(out, *v);
    for (const double v : {c.normal_force, c.clustered_force, c.gap, c.pressure, c.area})
        out.value(v);
    for (const int v : {int(c.status), c.body_a, c.body_b})
        out.value(v);
}

ContactRecord get_contact(ByteReader& in)
{
    ContactRecord c;
    for (Vec3* v : {&c.point, &c.force, &c.normal, &c.slip})
        *v = get_vector(in);
    for (double* v : {&c.normal_force, &c.clustered_force, &c.gap, &c.pressure, &c.area})
        *v = in.value<double>();
    const int status = in.value<int>();
    if (status < 0 || status > 2) ByteReader::refuse("an impossible contact");
    c.status = ContactStatus(status);
    c.body_a = in.value<int>();
    c.body_b = in.value<int>();
    return c;
}

void put(ByteWriter& out, const BeamRecord& b)
{
    put(out, b.name);
    out.value(std::uint64_t(b.points.size()));
    for (const Vec3& p : b.points)
        put(out, p);
    out.value(std::uint64_t(b.fields.size()));
    for (const Field& f : b.fields) {
        put(out, f.name);
        put(out, f.unit);
        out.value(f.components);
        out.vector(f.values);
    }
}

std::size_t get_size(ByteReader& in)
{
    const auto size = in.value<std::uint64_t>();
    if (size > kMost) ByteReader::refuse("an impossible size");
    return std::size_t(size);
}

BeamRecord get_beam(ByteReader& in)
{
    BeamRecord b;
    b.name = get_text(in);
    for (std::size_t n = get_size(in); n > 0; --n)
        b.points.push_back(get_vector(in));
    for (std::size_t n = get_size(in); n > 0; --n) {
        Field f;
        f.name = get_text(in);
        f.unit = get_text(in);
        f.components = in.value<int>();
        if (f.components < 1 || f.components > 9) ByteReader::refuse("an impossible field");
        f.values = in.vector<double>(kMost);
        b.fields.push_back(std::move(f));
    }
    return b;
}

} // namespace

std::vector<std::byte> bytes_of(const StepRecord& r)
{
    ByteWriter out;
    for (const int v : {r.step, r.iterations, r.factorisations, r.retries})
        out.value(v);
    for (const double v : {r.time, r.step_length, r.seconds})
        out.value(v);
    out.vector(r.errors);
    put(out, r.remark);
    out.value(std::uint64_t(r.beams.size()));
    for (const BeamRecord& b : r.beams)
        put(out, b);
    out.value(std::uint64_t(r.contacts.size()));
    for (const ContactRecord& c : r.contacts)
        put(out, c);
    const StepCertificate& c = r.certificate;
    for (const double v :
         {c.error, c.tolerance, c.worst_penetration, c.worst_cone_violation, c.worst_overlap.depth})
        out.value(v);
    put(out, c.worst_overlap.a);
    put(out, c.worst_overlap.b);
    put(out, c.worst_overlap.point);
    for (const int v : {c.worst_overlap.step, c.worst_contact, int(c.certified)})
        out.value(v);
    out.value(r.energy);
    out.value(r.phases);
    out.value(std::uint64_t(r.quantities.size()));
    for (const Quantity& q : r.quantities) {
        put(out, q.name);
        put(out, q.unit);
        out.value(q.value);
    }
    return out.take();
}

StepRecord record_from(const std::vector<std::byte>& bytes)
{
    ByteReader in(bytes);
    StepRecord r;
    for (int* v : {&r.step, &r.iterations, &r.factorisations, &r.retries})
        *v = in.value<int>();
    for (double* v : {&r.time, &r.step_length, &r.seconds})
        *v = in.value<double>();
    r.errors = in.vector<double>(kMost);
    r.remark = get_text(in);
    for (std::size_t n = get_size(in); n > 0; --n)
        r.beams.push_back(get_beam(in));
    for (std::size_t n = get_size(in); n > 0; --n)
        r.contacts.push_back(get_contact(in));
    StepCertificate& c = r.certificate;
    for (double* v : {&c.error, &c.tolerance, &c.worst_penetration, &c.worst_cone_violation,
                      &c.worst_overlap.depth})
        *v = in.value<double>();
    c.worst_overlap.a = get_text(in);
    c.worst_overlap.b = get_text(in);
    c.worst_overlap.point = get_vector(in);
    c.worst_overlap.step = in.value<int>();
    c.worst_contact = in.value<int>();
    c.certified = in.value<int>() != 0;
    r.energy = in.value<EnergyRecord>();
    r.phases = in.value<PhaseSeconds>();
    for (std::size_t n = get_size(in); n > 0; --n) {
        Quantity q;
        q.name = get_text(in);
        q.unit = get_text(in);
        q.value = in.value<double>();
        r.quantities.push_back(std::move(q));
    }
    in.end();
    return r;
}

} // namespace amontons
