% Reads what `export SCENE --form FORM --with-reference --out FOLDER` wrote: a struct with its arrays.
%
%     p = read_problem('FOLDER');
%     max(abs(p.P * p.x + p.q + p.G' * p.lam))       % primal, sparse
%     max(abs(min(p.lam, p.P * p.lam + p.q)))        % dual

function p = read_problem(folder)
    files = dir(fullfile(folder, '*.mtx'));
    for k = 1:numel(files)
        [~, name] = fileparts(files(k).name);
        p.(name) = read_mtx(fullfile(folder, files(k).name));
    end
end

function M = read_mtx(path)
    file = fopen(path);
    head = fgetl(file);
    line = fgetl(file);
    while line(1) == '%'
        line = fgetl(file);
    end
    shape = sscanf(line, '%f')';
    numbers = fscanf(file, '%f');
    fclose(file);
    if ~isempty(strfind(head, 'coordinate'))
        entries = reshape(numbers, 3, [])';
        M = sparse(entries(:, 1), entries(:, 2), entries(:, 3), shape(1), shape(2));
    else
        M = reshape(numbers, shape(1), shape(2));
    end
end
