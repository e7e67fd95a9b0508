# Reads what `export SCENE --form FORM --with-reference --out FOLDER` wrote, and checks its solution.
#
#     julia examples/readers/read_problem.jl FOLDER

using SparseArrays

function read_mtx(path)
    head, lines... = readlines(path)
    numbers = [parse.(Float64, split(line)) for line in lines if !startswith(line, "%")]
    rows, columns = Int.(numbers[1][1:2])
    if occursin("coordinate", head)
        entries = reduce(hcat, numbers[2:end]; init = zeros(3, 0))
        return sparse(Int.(entries[1, :]), Int.(entries[2, :]), entries[3, :], rows, columns)
    end
    M = reshape(reduce(vcat, numbers[2:end]), rows, columns)
    return columns == 1 ? vec(M) : M
end

if abspath(PROGRAM_FILE) == @__FILE__
    read_array(name) = read_mtx(joinpath(ARGS[1], name * ".mtx"))
    P, q, lam = read_array("P"), read_array("q"), read_array("lam")
    if isfile(joinpath(ARGS[1], "G.mtx"))  # primal, sparse: Px + q + Gᵀλ = 0
        residual = P * read_array("x") + q + read_array("G")' * lam
    else  # dual: λ ≥ 0, Pλ + q ≥ 0, one of them zero
        residual = min.(lam, P * lam + q)
    end
    println(length(q), " ", maximum(abs, residual))
end
