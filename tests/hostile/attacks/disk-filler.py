# title: Files without end
# told: No space left on device

number = 0
while True:
    number += 1
    with open(f"file-{number}", "wb") as file:
        file.write(b"x" * 2**20)
