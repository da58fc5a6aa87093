// Runs the tests on rank 0; under mpirun the other ranks work for it.

#include "mesh/tests/test_program.hpp"
#include "solver/large/large_matrix.hpp"

int main(int argc, char** argv)
{
    amontons::ParallelRun parallel;
    if (parallel.served()) return 0;
    return amontons::run_tests(argc, argv);
}
