// Reads what `export SCENE --form FORM --with-reference --out FOLDER` wrote, and checks its solution.
//
//     g++ -O2 -I /usr/include/eigen3 examples/readers/read_problem.cpp -o read_problem && ./read_problem FOLDER

#include <Eigen/Sparse>
#include <fstream>
#include <iostream>
#include <string>
#include <vector>

Eigen::SparseMatrix<double> read_mtx(const std::string& path) {
  std::ifstream in(path);
  std::string line;
  std::getline(in, line);
  const bool coordinates = line.find("coordinate") != std::string::npos;
  while (in.peek() == '%') std::getline(in, line);
  long rows, columns, i, j, count;
  in >> rows >> columns;
  if (coordinates) in >> count; else count = rows * columns;
  std::vector<Eigen::Triplet<double>> entries;
  double value;
  for (long k = 0; k < count; ++k) {
    if (coordinates) in >> i >> j; else { i = k % rows + 1; j = k / rows + 1; }
    in >> value;
    entries.emplace_back(i - 1, j - 1, value);
  }
  Eigen::SparseMatrix<double> M(rows, columns);
  M.setFromTriplets(entries.begin(), entries.end());
  return M;
}

int main(int, char** argv) {
  const std::string folder = std::string(argv[1]) + "/";
  const auto P = read_mtx(folder + "P.mtx");
  const Eigen::VectorXd q = read_mtx(folder + "q.mtx"), lam = read_mtx(folder + "lam.mtx");
  Eigen::VectorXd residual;
  if (std::ifstream(folder + "G.mtx")) {  // primal, sparse: Px + q + Gᵀλ = 0
    const Eigen::VectorXd x = read_mtx(folder + "x.mtx");
    residual = P * x + q + read_mtx(folder + "G.mtx").transpose() * lam;
  } else {  // dual: λ ≥ 0, Pλ + q ≥ 0, one of them zero
    residual = lam.cwiseMin(P * lam + q);
  }
  std::cout << q.size() << " " << residual.cwiseAbs().maxCoeff() << "\n";
}
