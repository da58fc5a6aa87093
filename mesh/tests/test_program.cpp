#define DOCTEST_CONFIG_IMPLEMENT
#include "mesh/tests/test_program.hpp"

#include <cstdio>
#include <doctest/doctest.h>

namespace amontons {
namespace {

// doctest makes its listeners itself, so what they count stands here.
int started = 0;      // test cases
int skipped = 0;      // of them
const char* name = ""; // of the one that runs

struct Counter : doctest::IReporter {
    explicit Counter(const doctest::ContextOptions&) {}
    void test_case_start(const doctest::TestCaseData& c) override
    {
        ++started;
        name = c.m_name;
    }
    void report_query(const doctest::QueryData&) override {}
    void test_run_start() override {}
    void test_run_end(const doctest::TestRunStats&) override {}
    void test_case_reenter(const doctest::TestCaseData&) override {}
    void test_case_end(const doctest::CurrentTestCaseStats&) override {}
    void test_case_exception(const doctest::TestCaseException&) override {}
    void subcase_start(const doctest::SubcaseSignature&) override {}
    void subcase_end() override {}
    void log_assert(const doctest::AssertData&) override {}
    void log_message(const doctest::MessageData&) override {}
    void test_case_skipped(const doctest::TestCaseData&) override {}
};
REGISTER_LISTENER("counter", 1, Counter);

} // namespace

void skip_test(std::string_view why)
{
    ++skipped;
    std::printf("skipped: %s: %.*s\n", name, int(why.size()), why.data());
    std::fflush(stdout);
}

int run_tests(int argc, char** argv)
{
    doctest::Context context(argc, argv);
    const int failed = context.run();
    if (context.shouldExit() || failed != 0) return failed; // a question such as --list-test-cases
    if (started == 0) {
        std::fprintf(stderr, "no test case is called so: nothing was tested\n");
        return 1;
    }
    return skipped == started ? kSkipped : 0;
}

} // namespace amontons
